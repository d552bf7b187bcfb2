"""Warp kernels, one source for CPU and CUDA. The only place that imports warp."""
