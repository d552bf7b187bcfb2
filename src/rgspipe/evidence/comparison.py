"""Which of several readings the views of a capture are clear about.

Views are the independent parts of a capture: each gives a score to each reading, and readings are compared by Student's
t of the differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from rgspipe.evidence.readings import Numbers

#: How seldom chance alone may look like a difference between two readings, or like agreement.
CHANCE = 1e-4

#: A reading is believed where it leaves at most this part of what the stated one leaves unexplained: depth that is 5 %
#: too long looks a little more like the other convention than like its own.
REMAINDER = 0.5

#: Fewer views than this have no spread that could be told.
FEWEST_VIEWS = 3

Key = TypeVar("Key")


def plainest(scores: Mapping[Key, Numbers]) -> Key:
    """The first of the readings, which stand in order, that none is better than beyond chance; scores (V,) of each."""
    best = max(scores.values(), key=lambda values: float(values.mean()))
    return next(reading for reading, values in scores.items() if not clearly_above(best - values))


def clearly_above(values: Numbers) -> bool:
    """Whether the mean of values (V,) is above zero by more than chance."""
    if np.ptp(values) == 0.0:
        return bool(values[0] > 0.0)
    # Slow to import, and asked only where readings come close.
    from scipy.stats import ttest_1samp

    return bool(ttest_1samp(values, 0.0, alternative="greater").pvalue < CHANCE)
