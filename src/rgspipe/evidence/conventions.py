"""Which reading of poses and depths the images are clear about.

A reading that differs from the files in less is taken before one that differs in more, unless the other is better
beyond chance; so where views hardly overlap, where axes and units make no difference or where everything is noisy, it
is the files that are believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rgspipe.datasets.views import View
from rgspipe.evidence.comparison import FEWEST_VIEWS, REMAINDER, clearly_above, plainest
from rgspipe.evidence.readings import READINGS, Reading
from rgspipe.evidence.reprojection import Agreement, Trials


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


def stated_agreement(views: Sequence[View], along_rays: bool) -> Agreement | None:
    """How the views' depth agrees as it was read; None where there are too few views to say."""
    measured = _measured(views)
    if len(measured) < FEWEST_VIEWS:
        return None
    return Trials.draw(measured, along_rays).agreement(READINGS[0])


def _measured(views: Sequence[View]) -> list[View]:
    return [view for view in views if view.depth is not None and bool(view.depth.isfinite().any())]
