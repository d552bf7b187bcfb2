"""Cameras of a pool: the scene's own three first, further ones between them."""

from __future__ import annotations

import numpy as np
import pytest
import torch

pytest.importorskip("bpy")

from rgspipe.blender.cameras import aimed
from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.pool.cameras import MOST_CAMERAS, pool_cameras
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


def test_given_cameras_take_the_place_of_the_scene_s_own() -> None:
    given = (FixedView((0.1, 0.2, 0.3), (0.5, 0.2, 0.3), 60.0), FixedView((0.0, 0.0, 1.0), (0.0, 0.3, 0.0), 90.0))
    cameras = pool_cameras(_Layout(), 1, given)
    # All of them decide a light's class, also those that are not among the views.
    assert len(cameras) == 2
    for camera, view in zip(cameras, given, strict=True):
        assert camera.origin.tolist() == list(view.origin) and (camera.width, camera.height) == (32, 32)
        pixel, depth = camera.project(torch.tensor(view.focus, dtype=torch.float64))
        # The point looked at is in the middle: 1e-14 of a pixel off, measured.
        assert depth > 0 and torch.allclose(pixel, torch.full((2,), 16.0, dtype=torch.float64), atol=1e-9)
    # tan(45°) = 1: half the width is the focal length.
    assert np.isclose(cameras[1].fx, 16.0)


def test_no_two_cameras_stand_together() -> None:
    origins = torch.stack([camera.origin for camera in pool_cameras(_Layout(), MOST_CAMERAS)])
    distance = torch.cdist(origins, origins) + torch.eye(MOST_CAMERAS)
    # Measured: 0.07.
    assert float(distance.min()) > 0.05
