"""Work on several starts at once: solves and kernels of one start leave the other cores idle."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Generic, TypeVar, overload

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


class kept_property(Generic[Found]):
    """`functools.cached_property` as it is from Python 3.12 on.

    Before, threads that make it for different objects wait for each other: a lock belongs to the class. Two that ask
    one object at once may both make it, so that it must not matter whose is kept.
    """

    def __init__(self, make: Callable[[Any], Found]) -> None:
        self.make, self.__doc__ = make, make.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, one: None, owner: type) -> kept_property[Found]: ...
    @overload
    def __get__(self, one: object, owner: type) -> Found: ...
    def __get__(self, one: object | None, owner: type) -> kept_property[Found] | Found:
        if one is None:
            return self
        found = self.make(one)
        vars(one)[self.name] = found
        return found
