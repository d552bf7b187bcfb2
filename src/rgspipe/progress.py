"""Progress with an estimate of the time left, shown on work that takes longer than two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeVar

from tqdm import tqdm

Item = TypeVar("Item")

#: Work that ends sooner than this many seconds shows nothing.
QUIET_SECONDS = 2.0

#: Is given progress in words, and nothing once it has ended.
Listener = Callable[[str], object]

#: Who listens, and since when.
_LISTENER: ContextVar[tuple[Listener, float] | None] = ContextVar("listener", default=None)

#: What tells this job from those beside it; empty where it is alone.
_JOB: ContextVar[str] = ContextVar("job", default="")

#: As tqdm's own, with the time that is left of everything.
_FORMAT = "{l_bar}{bar}| {n_fmt}/{total_fmt} [{elapsed}, {left} left{postfix}]"

#: Of a whole, whose items mean nothing to who waits for it.
_WHOLE = "{l_bar}{bar}| [{elapsed}, {left} left]"

#: For listeners: of a part of what they wait for, and of the whole.
_WORDS = "{desc}: {percentage:.0f} %, {left} left"
_WORDS_OF_WHOLE = f"{_WORDS} in all"

#: Seconds between lines on a terminal or for a listener, and in a log.
_OFTEN, _SELDOM = 0.2, 10.0


class ProgressBar(tqdm):
    """Progress whose estimate counts work that follows the items.

    Args:
        after: seconds of that work; None for tqdm's own estimate, of the items alone.
    """

    def __init__(self, *arguments: object, after: float | None = None, **options: object) -> None:
        self._after = after
        super().__init__(*arguments, **{"bar_format": None if after is None else _FORMAT} | options)

    def begin(self, total: int, done: int) -> None:
        """Say only now how many items there are, of which `done` were done before and tell nothing of the pace.

        The time up to now does not count either.
        """
        self.unpause()
        self.total, self.initial = total, done
        self.n = self.last_print_n = done
        self.refresh()

    @property
    def format_dict(self) -> dict[str, Any]:
        """What `_FORMAT` may name."""
        found = super().format_dict
        if self.total is None:
            return found
        done, seconds = self.n - self.initial, found["elapsed"]
        rate = found["rate"] or (done / seconds if seconds else 0.0)
        left = self.format_interval((self.total - self.n) / rate + (self._after or 0.0)) if rate else "?"
        return found | {"left": left}


class _Lines(ProgressBar):
    """Progress in a log: whole lines instead of one that is written over."""

    def display(self, msg: str | None = None, pos: int | None = None) -> bool:
        self.fp.write(f"{msg or self}\n")
        self.fp.flush()
        return True

    def clear(self, *arguments: object, **options: object) -> None:
        """A line that was written stays."""

    def close(self) -> None:
        """Nothing to wipe, so no carriage return either."""
        if not self.disable:
            self.disable = True
            self._decr_instances(self)


class _Words(_Lines):
    """Progress that is told to who asked for it, and not shown."""

    def __init__(self, *arguments: object, **options: object) -> None:
        self._listener, since = _LISTENER.get()
        # Silence between two parts of long work would look as if nothing went on.
        delay = max(0.0, QUIET_SECONDS - (time.monotonic() - since))
        words = _WORDS_OF_WHOLE if options.get("bar_format") == _WHOLE else _WORDS
        super().__init__(*arguments, **options | {"bar_format": words, "delay": delay})

    def display(self, msg: str | None = None, pos: int | None = None) -> bool:
        if self.total:
            self._listener(str(self) if self.n > self.initial else self.desc)
        return True

    def close(self) -> None:
        """Nothing goes on any more."""
        if not self.disable:
            self._listener("")
        super().close()


@contextmanager
def progress_told(listener: Listener) -> Iterator[None]:
    """Give the progress of work within the block, in this thread, to `listener` instead of showing it.

    Args:
        listener: is given "distant candidates: 40 %, 00:12 left" now and then, at once where the block has lasted for
            QUIET_SECONDS, and "" where such work has ended; in any thread.
    """
    token = _LISTENER.set((listener, time.monotonic()))
    try:
        yield
    finally:
        _LISTENER.reset(token)


@contextmanager
def progress_of_job(name: str) -> Iterator[None]:
    """Let the progress of work within the block, in this thread, begin with the name of its job.

    It comes in whole lines, on a terminal too, where jobs that run side by side would write over each other's.

    Args:
        name: tells the job from the others; empty where it is alone, so that all stays as it is.
    """
    token = _JOB.set(name)
    try:
        yield
    finally:
        _JOB.reset(token)


def progress_bar(
    items: Iterable[Item],
    description: str,
    total: int | None = None,
    unit: str = "it",
    *,
    done: int = 0,
    after: float | None = None,
    whole: bool = False,
) -> ProgressBar:
    """Iterate over `items` while a progress line with an estimate stands on stderr.

    On a terminal the line is written over; in a log, and within `progress_of_job`, a new one comes every ten seconds;
    within `progress_told` it is given to a listener. The returned bar can be iterated over, or updated by hand
    (`bar.update(1)`) in a `with` block, where `bar.begin(total, done)` may say later how much there is;
    `bar.set_postfix_str("38.2 dB", refresh=False)` shows a figure beside the estimate.

    Args:
        total: of items, those done before and later included; by default how many `items` has.
        done: how many were done before these.
        after: seconds of other work that follows and that the estimate shall include.
        whole: whether the items are shares of all that is waited for, which take as long as they are large: the
            estimate is by the pace since the beginning, and how many are done is not told. As such a whole may be one
            of many, which have a line, it has one only after ten seconds.
    """
    even = {"bar_format": _WHOLE, "smoothing": 0.0, "miniters": 0} if whole else {}
    told, job = _LISTENER.get() is not None, _JOB.get()
    interactive = sys.stderr.isatty() and not told and not job
    return (_Words if told else ProgressBar if interactive else _Lines)(
        items,
        desc=f"{job}: {description}" if job else description,
        total=total,
        unit=unit,
        initial=done,
        after=after,
        delay=_SELDOM if whole else QUIET_SECONDS,
        ncols=None if interactive else 100,
        dynamic_ncols=interactive,
        mininterval=_OFTEN if interactive or told else _SELDOM,
        leave=False,
        **even,
    )
