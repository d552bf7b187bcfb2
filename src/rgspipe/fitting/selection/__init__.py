"""How many lights, and what is to be said of the answer: a rig in, the rigs it was compared with and a verdict out."""
