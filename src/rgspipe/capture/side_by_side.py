"""Work on several starts at once: solves and kernels of one start leave the other cores idle."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch

from rgspipe.renderer.kernels.launch import thread_count

Item, Found = TypeVar("Item"), TypeVar("Found")


def side_by_side(work: Callable[[Item], Found], items: Iterable[Item]) -> list[Found]:
    """What `work` makes of each item, in their order; on as many threads as kernels use."""
    threads = thread_count()
    if threads == 1:
        return [work(item) for item in items]
    # What torch would use besides is for the other threads.
    with ThreadPoolExecutor(threads, "rgspipe-start", torch.set_num_threads, (1,)) as pool:
        return list(pool.map(work, items))
