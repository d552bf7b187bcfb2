"""Timing of single steps: warmed up, repeated, with the spread beside the median."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rgspipe.progress import progress_bar


@dataclass(frozen=True)
class Timing:
    """Milliseconds of one step over several runs."""

    step: str
    median_ms: float
    least_ms: float
    most_ms: float
    runs: int


def measure(step: str, run: Callable[[], object], repetitions: int) -> Timing:
    """Time `run` `repetitions` times after one run that is not counted."""
    run()
    seconds = []
    for _ in progress_bar(range(repetitions), step, unit="run"):
        begin = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - begin)
    milliseconds = 1e3 * np.array(seconds)
    return Timing(
        step, float(np.median(milliseconds)), float(milliseconds.min()), float(milliseconds.max()), len(seconds)
    )


def median_ms(run: Callable[[], object], repetitions: int) -> float:
    """Median milliseconds of `run` over `repetitions` runs, after one that is not counted."""
    run()
    seconds = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - begin)
    return 1e3 * float(np.median(seconds))


def load_average() -> float:
    """Processes that wanted a core over the last minute: a timing on a busy machine is no timing."""
    return os.getloadavg()[0]
