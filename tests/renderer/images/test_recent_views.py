"""What cameras that were looked through last have in common."""

from __future__ import annotations

import warnings
from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE, frozen_room
from rgspipe.scene import Camera, PointLight

LAMP = PointLight(list(VISIBLE), 0.5)


def test_a_camera_with_opencv_axes_is_told_of() -> None:
    scene = frozen_room()
    outside = Camera.look_at([0.0, -3.0, 0.1], [0.0, 0.0, 0.0], fov_degrees=30, width=8, height=8)
    flip = torch.diag(torch.tensor([1.0, -1.0, -1.0, 1.0], dtype=torch.float64))
    with pytest.warns(UserWarning, match=r"sees nothing of the scene.*look along −z.*OpenCV"):
        assert not scene.render(replace(outside, camera_to_world=outside.camera_to_world @ flip), LAMP).any()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert scene.render(outside, LAMP, sharp=False).any()
