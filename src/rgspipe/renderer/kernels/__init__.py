"""Warp kernels, one source for CPU and CUDA; those that only fits need are in `fitting.model.kernels`."""
