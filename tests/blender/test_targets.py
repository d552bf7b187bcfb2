"""The classes of fit targets, on cameras and obstacles simple enough to know the answer."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch

from rgspipe.blender.targets import classify, in_frame, random_intensity
from rgspipe.scene import Camera, look_at


def _camera(x: float) -> Camera:
    """From (x, −2, 0) towards the origin, 40° across: sees |x| < 0.73 at the origin."""
    pose = look_at(torch.tensor([x, -2.0, 0.0]), torch.zeros(3))
    return Camera.from_field_of_view(pose, math.radians(40.0), 32, 32)


CAMERAS = [_camera(0.0), _camera(-0.4), _camera(0.4)]


def _behind(y: float) -> Callable[[np.ndarray, np.ndarray], bool]:
    """An endless wall at this y."""
    return lambda start, end: (start[1] - y) * (end[1] - y) < 0


@pytest.mark.parametrize(
    ("point", "wall", "expected"),
    [
        ((0.0, 0.0, 0.0), 5.0, "visible"),
        ((0.0, 0.5, 0.1), 0.3, "occluded"),
        ((2.5, 0.0, 0.0), 5.0, "out_of_frame"),
        ((0.0, -3.0, 0.0), 5.0, "out_of_frame"),  # behind the cameras
        ((0.0, 0.0, 2.0), -1.0, "out_of_frame"),  # also behind the wall: the frame decides
        ((0.75, 0.0, 0.0), 5.0, None),  # only in some frames
    ],
)
def test_the_class_follows_from_frames_and_obstacles(point: tuple, wall: float, expected: str | None) -> None:
    assert classify(np.array(point), CAMERAS, _behind(wall)) == expected


def test_hidden_from_some_cameras_only_is_no_class() -> None:
    def hides_from_the_left(start: np.ndarray, end: np.ndarray) -> bool:
        return bool(start[0] < 0)

    assert classify(np.zeros(3), CAMERAS, hides_from_the_left) is None


def test_the_frame_ends_at_the_field_of_view() -> None:
    edge = 2.0 * math.tan(math.radians(20.0))
    assert in_frame(CAMERAS[0], np.array([0.999 * edge, 0.0, 0.0]))
    assert not in_frame(CAMERAS[0], np.array([1.001 * edge, 0.0, 0.0]))


def test_intensities_are_positive_and_seeded() -> None:
    draws = np.array([random_intensity(np.random.default_rng(seed), 2.0) for seed in range(200)])
    assert draws.min() >= 2.0 * math.exp(-0.7) and draws.max() <= 2.0 * math.exp(0.7)
    np.testing.assert_array_equal(draws[3], random_intensity(np.random.default_rng(3), 2.0))
