"""Progress with an estimate of the time left, shown on work that takes longer than two seconds."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")

#: Work that ends sooner than this many seconds shows nothing.
QUIET_SECONDS = 2.0


class _Lines(tqdm):
    """Progress in a log: whole lines instead of one that is written over."""

    def display(self, msg: str | None = None, pos: int | None = None) -> bool:
        # tqdm asks for an empty message to wipe the line at the end.
        if msg != "":
            self.fp.write(f"{msg or self}\n")
            self.fp.flush()
        return True

    def clear(self, *arguments: object, **options: object) -> None:
        """A line that was written stays."""


def track(items: Iterable[Item], description: str, total: int | None = None, unit: str = "it") -> tqdm:
    """Iterate over `items` while a progress line with an estimate stands on stderr.

    On a terminal the line is written over; in a log a new one comes every ten seconds. The returned bar can
    be iterated over, or updated by hand (`bar.update(1)`) in a `with` block; `bar.set_postfix_str("38.2 dB",
    refresh=False)` shows a figure beside the estimate.
    """
    interactive = sys.stderr.isatty()
    return (tqdm if interactive else _Lines)(
        items,
        desc=description,
        total=total,
        unit=unit,
        delay=QUIET_SECONDS,
        ncols=None if interactive else 100,
        dynamic_ncols=interactive,
        mininterval=0.2 if interactive else 10.0,
        leave=False,
    )
