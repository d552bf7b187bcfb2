"""Progress with an estimate of the time left, shown on work that takes longer than two seconds."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")

#: Work that ends sooner than this many seconds shows nothing.
QUIET_SECONDS = 2.0


def track(items: Iterable[Item], description: str, total: int | None = None, unit: str = "it") -> tqdm:
    """Iterate over `items` while a progress line with an estimate stands on stderr.

    The returned bar can be iterated over, or updated by hand (`bar.update(1)`) in a `with` block;
    `bar.set_postfix_str("38.2 dB")` shows a figure beside the estimate.
    """
    interactive = sys.stderr.isatty()
    return tqdm(
        items,
        desc=description,
        total=total,
        unit=unit,
        delay=QUIET_SECONDS,
        dynamic_ncols=interactive,
        mininterval=0.2 if interactive else 10.0,
        leave=False,
    )
