"""From which radiance on images were clipped: 8 bits end at a brightest level, and other images show it themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rgspipe.datasets.display_image import saturated_from
from rgspipe.datasets.frames import FrameEntry
from rgspipe.datasets.images import LINEAR
from rgspipe.datasets.views import View

#: Values of an image that ends by itself thin out towards its maximum; where it was clipped, more of them are equal to
#: the maximum than lie within this part of it below.
BELOW = 0.1


def with_saturation(entries: Sequence[FrameEntry], views: Sequence[View]) -> tuple[View, ...]:
    """Views that one camera took, each with the radiance from which on it tells only that the scene is as bright."""
    linear = [entry.image_path.suffix.lower() in LINEAR for entry in entries]
    clipped = common_maximum([view for view, is_linear in zip(views, linear, strict=True) if is_linear])
    return tuple(
        replace(view, saturated_from=_limit(entry, clipped if is_linear else saturated_from(entry.image_path)))
        for entry, view, is_linear in zip(entries, views, linear, strict=True)
    )


def _limit(entry: FrameEntry, found: float | None) -> float | None:
    """What the file itself says of an image stands over what its pixels say."""
    return found if entry.saturated_from is None else entry.saturated_from


def common_maximum(views: Sequence[View]) -> float | None:
    """The radiance at which images of floats were clipped, all at the same; None if they were not."""
    if not views:
        return None
    most = max(float(view.image.max()) for view in views)
    equal = sum(int((view.image == most).sum()) for view in views)
    below = sum(int(((view.image >= (1.0 - BELOW) * most) & (view.image < most)).sum()) for view in views)
    return most if most > 0.0 and equal > below > 0 else None
