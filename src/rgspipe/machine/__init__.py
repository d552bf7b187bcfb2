"""The machine: what it is, how threads share it, sums that do not depend on it, and where this program lies on it."""
