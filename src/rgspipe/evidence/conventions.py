"""Which reading of poses and depths the images are clear about.

A reading that differs from the files in less is taken before one that differs in more, unless the other is better
beyond chance; so where views hardly overlap, where axes and units make no difference or where everything is noisy, it
is the files that are believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgspipe.datasets.views import View
from rgspipe.evidence.comparison import FEWEST_VIEWS, REMAINDER, clearly_above, plainest
from rgspipe.evidence.readings import READINGS, Reading
from rgspipe.evidence.reprojection import Agreement, Trials

#: Views that agree in less than this part of the points that can be compared are no capture of one room, and so few
#: points do not tell. Poses of other photographs leave 0.17 to 0.27, poses that are 5 % of the room and 3° off 0.53.
LEAST_AGREEING, LEAST_TESTED = 0.4, 300

#: A view is astray where more than this part of its points that can be compared, and so many times as many as of the
#: median view, contradict others; of fewer points nothing is said. A pose that is 0.8 m off in a room of 4.2 m has
#: 0.26, beside 0.02; the worst of twenty good ones has 0.03, with depth of half the pixels 0.08 beside 0.06.
ASTRAY, TIMES_MEDIAN, LEAST_OF_ONE = 0.15, 5.0, 100


@dataclass(frozen=True)
class ViewFinding:
    """A reading that explains the images where the files' own does not.

    Attributes:
        reading: what was meant.
        found: how it does.
        stated: how what the files state does.
    """

    reading: Reading
    found: Agreement
    stated: Agreement


def misread(views: Sequence[View], along_rays: bool) -> ViewFinding | None:
    """The reading that the views' depth clearly calls for, if it is not the one that they were read by.

    Args:
        views: their depth may be missing.
        along_rays: whether their files state depth along rays.
    """
    measured = _measured(views)
    if len(measured) < FEWEST_VIEWS:
        return None
    trials = Trials.draw(measured, along_rays)
    results = {reading: trials.agreement(reading) for reading in READINGS}
    meant = plainest({reading: result.scores for reading, result in results.items()})
    stated, found = results[READINGS[0]], results[meant]
    if 1.0 - found.share > REMAINDER * (1.0 - stated.share) or not clearly_above(found.scores):
        return None
    return ViewFinding(meant, found, stated)


def contradicted(views: Sequence[View], along_rays: bool) -> Agreement | None:
    """How the views' depth agrees as it was read, if that is no capture of one room; None where it may be one."""
    measured = _measured(views)
    if len(measured) < FEWEST_VIEWS:
        return None
    stated = Trials.draw(measured, along_rays).agreement(READINGS[0])
    return stated if stated.tested >= LEAST_TESTED and stated.share < LEAST_AGREEING else None


@dataclass(frozen=True)
class AstrayView:
    """A view whose points contradict others, where most views agree.

    Attributes:
        index: of the view, among all.
        contradicting: part of its points that do.
        usual: that of the median view.
    """

    index: int
    contradicting: float
    usual: float


@dataclass(frozen=True)
class AgainstOthers:
    """What the points of each view with depth are to the other views; nothing where too few have it.

    Attributes:
        index: (V,) of these views, among all.
        tested: (V,) how many of their points others see.
        contradicting: (V,) how many of these contradict them.
    """

    index: np.ndarray
    tested: np.ndarray
    contradicting: np.ndarray

    @classmethod
    def of(cls, views: Sequence[View], along_rays: bool) -> AgainstOthers:
        """Of all views, whose depth is distances along rays if `along_rays`, as it is stated."""
        measured = _measured(views)
        if len(measured) < FEWEST_VIEWS:
            return cls(np.empty(0, int), np.empty(0), np.empty(0))
        trials = Trials.draw(measured, along_rays)
        stated = trials.agreement(READINGS[0])
        places = {id(view): index for index, view in enumerate(views)}
        index = np.array([places[id(view)] for view in trials.views])
        return cls(index, stated.agreeing + stated.contradicting, stated.contradicting)

    @property
    def astray(self) -> list[AstrayView]:
        """Single views whose pose or depth is not that of the others, as far as their points tell."""
        if not len(self.index):
            return []
        shares = self.contradicting / np.maximum(self.tested, 1)
        usual = float(np.median(shares))
        told = (self.tested >= LEAST_OF_ONE) & (shares > max(ASTRAY, TIMES_MEDIAN * usual))
        return [AstrayView(int(self.index[k]), float(shares[k]), usual) for k in told.nonzero()[0]]

    @property
    def alone(self) -> list[int]:
        """Which views no other one shares a place with, where most views share many."""
        if not len(self.index) or np.median(self.tested) < LEAST_OF_ONE:
            return []
        return self.index[self.tested == 0].tolist()


def _measured(views: Sequence[View]) -> list[View]:
    return [view for view in views if view.depth is not None and bool(view.depth.isfinite().any())]
