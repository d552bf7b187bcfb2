"""Cameras go to the browser and come back as they were, and look where they looked."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.scene import Camera
from rgspipe.viewer.cameras import axis_of, camera_of, first_camera, pose_of, turned_to

NUMBER = st.floats(-1.0, 1.0)


@pytest.mark.parametrize(("width", "height"), [(96, 64), (64, 96), (80, 80)])
def test_a_camera_comes_back_from_the_browser(width: int, height: int) -> None:
    camera = Camera.look_at([1.0, -2.0, 0.5], [0.1, 0.2, 0.3], fov_degrees=50.0, width=width, height=height)
    back = camera_of(*pose_of(camera), width / height, max(width, height))
    assert (back.width, back.height) == (width, height)
    # Measured 2e-16 and 1e-14.
    torch.testing.assert_close(back.camera_to_world, camera.camera_to_world, atol=1e-12, rtol=0.0)
    np.testing.assert_allclose([back.fx, back.fy, back.cx, back.cy], [camera.fx, camera.fy, camera.cx, camera.cy])


def test_the_browser_looks_along_z_and_the_scene_the_other_way() -> None:
    camera = camera_of(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), 0.8, 1.0, 16)
    ahead, up = -camera.camera_to_world[:3, 2], camera.camera_to_world[:3, 1]
    assert ahead.tolist() == [0.0, 0.0, 1.0] and up.tolist() == [0.0, -1.0, 0.0]


@settings(deadline=None)
@given(NUMBER, NUMBER, NUMBER)
def test_an_axis_comes_back(x: float, y: float, z: float) -> None:
    axis = torch.tensor([x, y, z], dtype=torch.float64)
    if float(axis.norm()) < 1e-3:
        return
    wxyz = turned_to(axis)
    assert math.isclose(float(np.linalg.norm(wxyz)), 1.0, rel_tol=1e-12)
    torch.testing.assert_close(axis_of(wxyz), axis / axis.norm(), atol=1e-9, rtol=0.0)


@settings(deadline=None)
@given(st.tuples(NUMBER, NUMBER, NUMBER), st.tuples(*[st.floats(0.0, 3.0)] * 3))
def test_the_first_camera_sees_the_whole_scene(lower: tuple[float, ...], sides: tuple[float, ...]) -> None:
    low = torch.tensor(lower, dtype=torch.float64)
    high = low + torch.tensor(sides, dtype=torch.float64)
    camera = first_camera(low, high)
    to_camera = torch.linalg.inv(camera.camera_to_world)
    picks = torch.cartesian_prod(*[torch.tensor([0.0, 1.0], dtype=torch.float64)] * 3)
    corners = low + picks * (high - low)
    seen = corners @ to_camera[:3, :3].T + to_camera[:3, 3]
    ahead = -seen[:, 2]
    assert bool((ahead > 0.0).all())
    across = (camera.fx * seen[:, 0] / ahead).abs().max(), (camera.fy * seen[:, 1] / ahead).abs().max()
    assert float(across[0]) <= 0.5 * camera.width and float(across[1]) <= 0.5 * camera.height
