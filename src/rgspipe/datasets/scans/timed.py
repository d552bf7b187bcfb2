"""What was measured at times of its own, brought to those of photographs."""

from __future__ import annotations

import numpy as np

from rgspipe.datasets.scans.frame import Numbers


def nearest(times: Numbers, wanted: Numbers, apart: float) -> list[int | None]:
    """For each time that is wanted [s] which of some times (N,) is the nearest; None where that is too far `apart`."""
    if len(times) == 0:
        return [None] * len(wanted)
    order = np.argsort(times, kind="stable")
    after = np.searchsorted(times[order], wanted).clip(0, len(times) - 1)
    sides = np.stack([order[(after - 1).clip(0)], order[after]])
    gaps = np.abs(times[sides] - wanted)
    best = gaps.argmin(axis=0)
    columns = np.arange(len(wanted))
    return [
        int(index) if gap <= apart else None
        for index, gap in zip(sides[best, columns], gaps[best, columns], strict=True)
    ]
