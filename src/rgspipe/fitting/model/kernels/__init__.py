"""Kernels of fits: what only they compute. Those that rendering shares are in `renderer.kernels`."""
