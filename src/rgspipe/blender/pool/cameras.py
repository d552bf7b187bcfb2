"""The fixed cameras that see a pool of lights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from rgspipe.blender.cameras import Layout, aimed
from rgspipe.blender.fixed_view import FixedView
from rgspipe.scene import Camera, look_at

#: Where further cameras stand between the three that see the fit targets of a scene: their shares of each.
BETWEEN = (
    (0.5, 0.5, 0.0),
    (0.5, 0.0, 0.5),
    (0.0, 0.5, 0.5),
    (0.68, 0.16, 0.16),
    (0.24, 0.38, 0.38),
)

#: Most cameras of a pool.
MOST_CAMERAS = 3 + len(BETWEEN)


def pool_cameras(layout: Layout, views: int, fixed: Sequence[FixedView] = ()) -> list[Camera]:
    """The cameras of `fixed`; without any the scene's own three, and between them as many more as `views` asks for.

    Further cameras stand among the first three, so that a light that is out of the sight of those is so for the
    others as a rule, and its class (which all cameras decide) means the same for any number of views.
    """
    first = layout.target_cameras()
    if fixed:
        size = first[0].width
        return [aimed(np.array(view.origin), np.array(view.focus), view.degrees, size) for view in fixed]
    return [*first, *(_between(first, shares) for shares in BETWEEN[: max(0, views - len(first))])]


def _between(cameras: list[Camera], shares: tuple[float, ...]) -> Camera:
    """A camera whose place and direction are the weighted means of those of `cameras`, with the first one's lens."""
    weights = torch.tensor(shares, dtype=torch.float64)
    origin = weights @ torch.stack([camera.origin.double() for camera in cameras])
    forward = weights @ torch.stack([-camera.camera_to_world[:3, 2].double() for camera in cameras])
    lens = cameras[0]
    pose = look_at(origin, origin + forward)
    return Camera(pose, lens.fx, lens.fy, lens.cx, lens.cy, lens.width, lens.height)
