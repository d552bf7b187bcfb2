"""What a file from a stranger may cost: more is refused by its header or its size, before it is decoded.

Time is limited, too: a reader is stopped once it has taken too much of its processor. Code of libraries cannot be
stopped half way; what it made is refused when it comes back, and sizes bound how long that can be.
"""

from __future__ import annotations

import contextlib
import functools
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

from rgspipe.errors import InputError
from rgspipe.options import Options, option

#: What helps where a file is as large as it is meant to be.
RAISE = "If it is meant to be so large: limits.* (in Python rg.reading_within)."

#: Bytes of a pixel that is stored without compression, with what else stands in a row, and of all that is no pixel.
PIXEL_BYTES, HEADER_BYTES = 12, 2**16

#: Seconds between two looks at the clock.
TICK = 0.5

Arguments, Made = ParamSpec("Arguments"), TypeVar("Made")


@dataclass(frozen=True)
class ReadingLimits(Options):
    """Sizes from which on files are refused."""

    pixels: int = option(100_000_000, low=1, high=10**10)
    """pixels of the largest image, photograph or depth map; so many take 1.2 GB in colour"""
    cropped_pixels: int = option(2**24, low=1, high=10**10)
    """pixels of the largest image of which only a part is stored, so that a few bytes could claim any size"""
    vertices: int = option(20_000_000, low=2, high=10**10)
    """vertices of the largest PLY file, and triangles of the largest mesh; of a trained scene, so many take 5 GB"""
    text_bytes: int = option(2**26, low=1, high=2**40)
    """bytes of the largest JSON file, list of poses or measured luminaire: cameras of 100 000 views take half of it"""
    bytes: int = option(2**34, low=1, high=2**44)
    """bytes of the largest mesh, file of tensors, or part of a COLMAP model"""
    seconds: float = option(600.0, low=1e-3, high=1e9)
    """seconds of its processor that reading one file may take; what no header bounds, such as text, is stopped then"""

    @property
    def image_bytes(self) -> int:
        """Bytes of the largest image in a format that bounds them by its pixels."""
        return PIXEL_BYTES * self.pixels + HEADER_BYTES


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


class _TookTooLong(BaseException):
    """Passes through readers that take any error for damage of the file."""


def timed(
    read: Callable[Concatenate[Path, Arguments], Made],
) -> Callable[Concatenate[str | Path, Arguments], Made]:
    """A reader of a file that refuses it once that has taken longer than the limit, or all memory."""

    @functools.wraps(read)
    def limited(path: str | Path, *arguments: Arguments.args, **options: Arguments.kwargs) -> Made:
        begin, most = time.thread_time(), reading_limits().seconds

        def look(*_: object) -> None:
            if time.thread_time() - begin > most:
                raise _TookTooLong

        try:
            with _ticking(look):
                made = read(path, *arguments, **options)
            look()
        except _TookTooLong:
            raise InputError(
                path,
                expected=f"a file that is read in at most {most:g} s",
                found="one that takes longer",
                remedy=f"Check the file. {RAISE}",
            ) from None
        except MemoryError as error:
            found, remedy = (
                f"one that does not ({str(error) or 'no room'})",
                "Check the file, or read it where there is more.",
            )
            raise InputError(path, expected="a file that fits into memory", found=found, remedy=remedy) from None
        return made

    return limited


@contextlib.contextmanager
def _ticking(look: Callable[..., None]) -> Iterator[None]:
    """Have something called again and again while the block computes; signals reach the main thread alone."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = signal.signal(signal.SIGVTALRM, look)
    timer = signal.setitimer(signal.ITIMER_VIRTUAL, min(TICK, reading_limits().seconds), TICK)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, *timer)
        signal.signal(signal.SIGVTALRM, former if former is not None else signal.SIG_DFL)
