"""The graph of stages: which artifacts a configuration asks for, in which order, why, and how long it takes."""
