"""What a file from a stranger may cost: more is refused by its header or its size, before it is decoded.

Time has no limit of its own: that of every reader is in proportion to what is limited here.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from dataclasses import dataclass

from rgspipe.options import Options, option


@dataclass(frozen=True)
class ReadingLimits(Options):
    """Sizes from which on files are refused."""

    pixels: int = option(100_000_000, low=1, high=10**10)
    """pixels of the largest image; decoded, so many take 1.2 GB"""
    cropped_pixels: int = option(2**24, low=1, high=10**10)
    """pixels of the largest image of which only a part is stored, so that a few bytes could claim any size"""
    vertices: int = option(20_000_000, low=2, high=10**10)
    """vertices of the largest PLY file; of a trained scene, so many take 5 GB"""
    text_bytes: int = option(2**28, low=1, high=2**40)
    """bytes of the largest JSON file, or list of poses: cameras of 100 000 views take a tenth of the default"""
    bytes: int = option(2**34, low=1, high=2**44)
    """bytes of the largest file of tensors, or part of a COLMAP model"""


_limits: ContextVar[ReadingLimits | None] = ContextVar("reading limits", default=None)


def reading_limits() -> ReadingLimits:
    """Those that hold here."""
    return _limits.get() or ReadingLimits()


@contextlib.contextmanager
def reading_within(limits: ReadingLimits) -> Iterator[None]:
    """Have all files that the block reads stay within limits; readers refuse what does not, with an InputError.

    Readers are many, and what they are called by need not know of it: as with decimal's precision, limits belong to
    the context.
    """
    token = _limits.set(limits)
    try:
        yield
    finally:
        _limits.reset(token)
