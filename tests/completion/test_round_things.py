"""Round things of which one side was seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from scipy.spatial import cKDTree

from half_seen_room import camera_at, only, seen_by
from rgspipe.completion import with_unseen_surfaces
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.scene.rectangles import rectangle, surfels_on
from rgspipe.scene.surfels import quaternion_from_normal

#: Distance of surfels.
SPACING = 0.03


def ball(radius: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Places and normals on one about the origin."""
    normals = fibonacci_directions(round(4.0 * np.pi * radius**2 / SPACING**2)).double()
    return radius * normals, normals


def test_a_ball_in_the_open_gets_its_other_side() -> None:
    """It lies on a floor, and all cameras stand on one side of it."""
    places, normals = ball(0.3)
    floor = surfels_on(
        rectangle([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5] * 3), round(4.0 / SPACING**2)
    )
    whole = only(floor, torch.zeros(len(places), dtype=torch.int64))
    whole = replace(whole, centers=places + torch.tensor([0.0, 0.0, 0.3]), rotations=quaternion_from_normal(normals))
    scene = replace(floor, **{name: torch.cat([part, floor.tensors()[name]]) for name, part in whole.tensors().items()})
    cameras = [camera_at([x, -1.8, z], [0.0, 0.0, 0.2], 64, 0.9) for x, z in ((-0.9, 0.9), (0.0, 1.3), (0.9, 0.7))]
    seen = seen_by(cameras, scene)
    closed = with_unseen_surfaces(seen, cameras)
    added = closed.centers[len(seen) :]
    added = added[added[:, 2] > 0.01]
    back = whole.centers[(whole.centers[:, 1] > 0.1) & (whole.centers[:, 2] > 0.1)]
    before, after = (cKDTree(one.centers.numpy()).query(back.numpy())[0] / SPACING for one in (seen, closed))
    off = cKDTree(scene.centers.numpy()).query(added.numpy())[0] / SPACING
    assert float(np.median(before)) > 5.0  # measured 5.73
    assert float(np.quantile(after, 0.9)) < 0.7 and float(np.quantile(off, 0.9)) < 0.7  # measured 0.57 and 0.56
    assert float(off.max()) < 2.5  # measured 2.12
