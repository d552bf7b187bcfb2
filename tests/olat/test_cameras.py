"""Cameras of a pool: the scene's own three first, further ones between them."""

from __future__ import annotations

import numpy as np
import torch

from rgspipe.blender.cameras import aimed
from rgspipe.olat.cameras import MOST_CAMERAS, pool_cameras
from rgspipe.scene import Camera

ORIGINS = np.array([[0.0, -1.5, 0.0], [-0.4, -1.2, 0.3], [0.4, -1.2, 0.3]])


class _Layout:
    def target_cameras(self) -> list[Camera]:
        return [aimed(origin, np.zeros(3), 40.0, 32) for origin in ORIGINS]


def test_few_views_are_the_scene_s_own_cameras() -> None:
    own = _Layout().target_cameras()
    for views in (1, 3):
        for camera, expected in zip(pool_cameras(_Layout(), views), own, strict=True):
            assert torch.equal(camera.camera_to_world, expected.camera_to_world)


def test_further_cameras_stand_inside_the_triangle_of_the_first_and_look_where_they_look() -> None:
    cameras = pool_cameras(_Layout(), MOST_CAMERAS)
    assert len(cameras) == 8
    for camera in cameras[3:]:
        shares = np.linalg.solve(np.vstack([ORIGINS.T]), camera.origin.numpy())
        assert shares.min() > -1e-12 and np.isclose(shares.sum(), 1.0)
        pixel, depth = camera.project(torch.zeros(3, dtype=torch.float64))
        # Directions are averaged, not places, so the focus is a pixel off the middle of 32: 0.6 at most, measured.
        assert depth > 0 and float((pixel - 16.0).abs().max()) < 1.0


def test_no_two_cameras_stand_together() -> None:
    origins = torch.stack([camera.origin for camera in pool_cameras(_Layout(), MOST_CAMERAS)])
    distance = torch.cdist(origins, origins) + torch.eye(MOST_CAMERAS)
    # Measured: 0.07.
    assert float(distance.min()) > 0.05
