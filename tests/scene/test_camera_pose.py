"""What a camera's pose and lens may not be: each would give a picture, and a wrong one."""

from __future__ import annotations

import numpy as np
import pytest

from rgspipe.errors import InputError
from rgspipe.scene.camera import Camera, look_at

POSE = look_at([0.0, -1.5, 0.05], [0.0, 0.0, 0.0]).numpy()


def camera(pose: np.ndarray, fx: float = 100.0) -> Camera:
    return Camera(pose, fx, 100.0, 32.0, 32.0, 64, 64)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (2.0 * POSE @ np.diag([1, 1, 1, 0.5]), "camera_to_world.*RᵀR − 1 up to 3, .*scale"),
        (POSE @ np.diag([1, 1, -1, 1]), "camera_to_world.*mirrored"),
        (POSE.T, "camera_to_world.*transposed"),
        (2.0 * POSE, "camera_to_world.*last row"),
    ],
)
def test_a_pose_that_is_not_rigid_is_refused(pose: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        camera(pose)


def test_opencv_axes_and_single_precision_are_rigid() -> None:
    assert camera(POSE @ np.diag([1, -1, -1, 1])).width == 64
    assert camera(POSE.astype(np.float32)).width == 64


@pytest.mark.parametrize("length", [0.0, -100.0, float("inf"), float("nan")])
def test_a_focal_length_is_positive(length: float) -> None:
    with pytest.raises(InputError, match="fx: expected a focal length"):
        camera(POSE, fx=length)
