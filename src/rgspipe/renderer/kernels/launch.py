"""Launches that use every core: Warp's CPU backend runs one launch on one thread, so a launch is cut into slices."""

from __future__ import annotations

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import torch
import warp as wp
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.renderer.kernels.kernel_cache import start_with_cache

wp.config.log_level = wp.LOG_ERROR


def _start() -> None:
    """Start Warp; on a machine without a GPU, without the warning that its native code prints about the driver."""
    if torch.cuda.is_available():
        wp.init()
        return
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
            wp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)


start_with_cache(_start)


def warp_finds_gpu() -> bool:
    """Whether Warp can use a GPU, for which it may need a newer driver than torch."""
    return wp.is_cuda_available()


#: Slices per thread of a launch whose items differ in cost; more slices balance better and start slower.
SLICES_PER_THREAD = 4


@lru_cache(maxsize=1)
def thread_count() -> int:
    """Threads that a launch may use: as many as torch was told to use, at most the cores we may run on."""
    return max(1, min(torch.get_num_threads(), len(os.sched_getaffinity(0))))


@lru_cache(maxsize=1)
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(thread_count(), thread_name_prefix="rgspipe-kernel")


# A forked process has none of its parent's threads, and would wait for them for ever.
os.register_at_fork(after_in_child=_threads.cache_clear)


def slices(count: int, parts: int) -> list[tuple[int, int]]:
    """`parts` nearly equal (start, length) ranges that cover `count` items; empty ones are left out."""
    bounds = [count * k // parts for k in range(parts + 1)]
    return [(a, b - a) for a, b in pairwise(bounds) if b > a]


def torch_stream(device: torch.device) -> AbstractContextManager[object]:
    """Within it Warp works on torch's current stream, so that neither reads what the other has not written yet."""
    if device.type == "cpu":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))


def launch(
    kernel: wp.Kernel,
    count: int,
    inputs: list[Any],
    device: torch.device,
    slabs: int | None = None,
    even: bool = False,
) -> None:
    """Run `kernel` over items 0 … count−1; its first two arguments are the offset and the slab of the slice.

    Args:
        slabs: number of slices, each with a private slab to accumulate into (CPU additions are not
            atomic across launches, and private slabs keep sums in one order). None: as many as balance.
        even: whether all items cost the same, so that one slice a thread balances; a slice takes 0.05 ms to start.
    """
    if count == 0:
        return
    _check_default_dtype()
    if device.type != "cpu":
        with torch_stream(device):
            wp.launch(kernel, dim=count, inputs=[0, 0, *inputs], device=wp.device_from_torch(device))
        return
    threads = thread_count()
    balanced = threads if even or threads == 1 else threads * SLICES_PER_THREAD
    parts = slices(count, slabs or min(count, balanced))
    if len(parts) == 1:
        wp.launch(kernel, dim=count, inputs=[0, 0, *inputs], device="cpu")
        return

    def run(slab: int) -> None:
        offset, length = parts[slab]
        wp.launch(kernel, dim=length, inputs=[offset, slab, *inputs], device="cpu")

    # Compile and load before the threads start, so that they do not queue on the module lock.
    kernel.module.load(wp.get_device("cpu"), block_dim=1)
    list(_threads().map(run, range(len(parts))))


def _check_default_dtype() -> None:
    """Refuse another default type than that of the kernels, in which tensors between them are made.

    Raises:
        InputError: somebody has set it.
    """
    default = torch.get_default_dtype()
    if default != torch.float32:
        remedy = "Set it back to torch.float32, and pass dtypes where you want others."
        raise InputError("torch.set_default_dtype", expected="torch.float32", found=str(default), remedy=remedy)


def as_vec3(tensor: Tensor) -> wp.array:
    """(N, 3) float32 tensor as an array of vec3, without a copy where it is contiguous."""
    return wp.from_torch(tensor.detach().float().contiguous(), dtype=wp.vec3)


def as_vec4(tensor: Tensor) -> wp.array:
    """(N, 4) float32 tensor as an array of vec4, without a copy where it is contiguous."""
    return wp.from_torch(tensor.detach().float().contiguous(), dtype=wp.vec4)


def as_array(tensor: Tensor) -> wp.array:
    """A tensor as a Warp array of the same scalar type, without a copy where it is contiguous."""
    return wp.from_torch(tensor.detach().contiguous())


def vector(tensor: Tensor) -> wp.vec3:
    """(3,) tensor as one float32 vector."""
    return wp.vec3(*tensor.detach().float().cpu().tolist())
