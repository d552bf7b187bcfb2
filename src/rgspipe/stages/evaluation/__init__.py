"""Comparison with what is known: the scene with held-out views, recovered lights with the truth."""
