"""Equality of things that hold tensors."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from torch import Tensor


class ByValue:
    """A dataclass that equals another of its class where all numbers are the same.

    The equality that dataclasses are given asks whether a tensor of truths is true, which raises. Numbers are compared
    exactly, wherever they are and whether or not they require gradients: what was saved and read again is equal, what
    was rounded to float32 is not. Large things, such as surfels and scenes, are equal to themselves alone.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        # A dataclass keeps what its own class says of equality, but not what a base does.
        cls.__eq__, cls.__hash__ = ByValue.__eq__, ByValue.__hash__

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(_plain(getattr(self, item.name)) == _plain(getattr(other, item.name)) for item in fields(self))

    def __hash__(self) -> int:
        # An optimiser moves tensors in place, and the hash of what stands in a set must stay.
        return hash(type(self))


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, Tensor) else value
