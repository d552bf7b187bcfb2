"""What masks of a target leave out, in words."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from rgspipe.datasets.views import View

#: Masks that leave out more than this part of what the scene shows may be the wrong way round.
MOSTLY = 0.5


def masked_out(target: str, views: Sequence[View], coverages: Sequence[Tensor]) -> str:
    """A line about masks that leave out most of what the scene shows, as those that are the wrong way round.

    Args:
        coverages: (P,) of each view, by the scene's surfels.
    """
    left_out = shown = 0
    for view, coverage in zip(views, coverages, strict=True):
        seen = coverage.reshape(-1).cpu() >= 0.5
        left_out += int((seen & (view.alpha.reshape(-1) < 0.5)).sum())
        shown += int(seen.sum())
    share = left_out / max(shown, 1)
    if share <= MOSTLY:
        return ""
    return (
        f"target {target}: masks or alpha leave out {100 * share:.0f} % of what the scene shows in its images. What is "
        "black in a mask does not count: if it is meant the other way round, invert the masks."
    )
