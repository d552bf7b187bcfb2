"""Which reading of poses and depths the images are clear about.

Readings are compared over the views, which are the independent parts of a capture: for each of them the points that
agree less those that contradict, and Student's t of the differences. A reading that differs from the files in less is
taken before one that differs in more, unless the other is better beyond chance; so where views hardly overlap, where
axes and units make no difference or where everything is noisy, it is the files that are believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import ttest_1samp

from rgspipe.datasets.views import View
from rgspipe.evidence.readings import READINGS, Numbers, Reading
from rgspipe.evidence.reprojection import Agreement, Trials

#: How seldom chance alone may look like a difference between two readings, or like agreement.
CHANCE = 1e-4

#: A reading is believed where it leaves at most this part of the contradictions: depth that is 5 % too long looks a
#: little more like the other convention than like its own.
REMAINDER = 0.5

#: Fewer views than this have no spread that could be told.
FEWEST_VIEWS = 3


@dataclass(frozen=True)
class Finding:
    """A reading that explains the images where the files' own does not.

    Attributes:
        reading: what was meant.
        found: how it does.
        stated: how what the files state does.
    """

    reading: Reading
    found: Agreement
    stated: Agreement


def misread(views: Sequence[View], along_rays: bool) -> Finding | None:
    """The reading that the views' depth clearly calls for, if it is not the one that they were read by.

    Args:
        views: their depth may be missing.
        along_rays: whether their files state depth along rays.
    """
    measured = [view for view in views if view.depth is not None and bool(view.depth.isfinite().any())]
    if len(measured) < FEWEST_VIEWS:
        return None
    trials = Trials.draw(measured, along_rays)
    results = {reading: trials.agreement(reading) for reading in READINGS}
    best = max(results.values(), key=lambda result: result.scores.mean())
    plainest = next(reading for reading in READINGS if not _clearly_above(best.scores - results[reading].scores))
    stated, found = results[READINGS[0]], results[plainest]
    if 1.0 - found.share > REMAINDER * (1.0 - stated.share) or not _clearly_above(found.scores):
        return None
    return Finding(plainest, found, stated)


def _clearly_above(values: Numbers) -> bool:
    """Whether the mean of values (V,) is above zero by more than chance."""
    if np.ptp(values) == 0.0:
        return bool(values[0] > 0.0)
    return bool(ttest_1samp(values, 0.0, alternative="greater").pvalue < CHANCE)
