"""Of large photographs a part of the pixels, spread evenly: a surfel's radiance is one number, however many show it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace

from torch import Tensor

from rgspipe.datasets.views import View

#: Pixels of all photographs that are looked at for each surfel, at least, on average where there are as many.
PIXELS = 100


def thinning(views: Sequence[View], surfels: int) -> int:
    """Each how many pixels, along rows and along columns, one is looked at."""
    return max(1, math.isqrt(sum(view.camera.pixel_count for view in views) // (PIXELS * max(surfels, 1))))


def thinned(view: View, step: int) -> View:
    """The view with one of `step`² pixels, as it is in the photograph: what is clipped stays what it was."""
    if step == 1:
        return view
    first, camera = (step - 1) // 2, view.camera

    def kept(size: int) -> int:
        return max(1, -(-(size - first) // step))

    camera = replace(
        camera,
        fx=camera.fx / step,
        fy=camera.fy / step,
        # The middles of the pixels that are left stay where they were.
        cx=0.5 + (camera.cx - first - 0.5) / step,
        cy=0.5 + (camera.cy - first - 0.5) / step,
        width=kept(camera.width),
        height=kept(camera.height),
    )
    parts = {field.name: getattr(view, field.name) for field in fields(view)}
    parts = {name: part[first::step, first::step] for name, part in parts.items() if isinstance(part, Tensor)}
    return replace(view, camera=camera, **parts)
