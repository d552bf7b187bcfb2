"""What lights are read from, whatever the file is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from torch import Tensor


class Reader(Protocol):
    """A light's fields in a file; what is missing or impossible is refused by name."""

    def vector(self, key: str) -> Tensor:
        """(3,) float64."""
        ...

    def direction(self, key: str) -> Tensor:
        """(3,) float64 of unit length."""
        ...

    def number(self, key: str) -> float:
        """A finite number."""
        ...

    def text(self, key: str) -> str:
        """A string."""
        ...

    def numbers(self, key: str) -> Tensor:
        """(K,) float64, a list of any length but 0."""
        ...

    def choice(self, key: str, names: Sequence[str]) -> str:
        """One of `names`."""
        ...
