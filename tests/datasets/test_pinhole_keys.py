"""Focal lengths and principal point beside, or in the place of, a field of view."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from rgspipe.datasets.gs3 import load_target
from rgspipe.errors import InputError
from rgspipe.scene import Camera

Change = Callable[[str, Callable[[dict], object]], None]
TARGET = "targets/one/transforms.json"

#: Of an image of 6 × 4 pixels with fl_x = 5.
ANGLE = 2.0 * math.atan(0.5 * 6 / 5)

#: Of the same with fl_y = 4.
DOWN = 2.0 * math.atan(0.5 * 4 / 4)

#: Of the camera for an image twice as large.
TWICE = {"fl_x": 10, "fl_y": 8, "cx": 5, "cy": 4.4, "w": 12, "h": 8}


def _camera(dataset: Path, change: Change, frame: dict, shared: dict) -> Camera:
    def edit(content: dict) -> None:
        for key in ("camera_intrinsics", "w", "h"):
            content["frames"][0].pop(key, None)
        content["frames"][0].update(frame)
        content.update(shared)

    change(TARGET, edit)
    (view,) = load_target(dataset / "targets/one").views
    return view.camera


@pytest.mark.parametrize(
    ("frame", "shared", "expected"),
    [
        ({}, {"camera_angle_x": ANGLE, "fl_x": 5, "fl_y": 4, "cx": 2.5, "cy": 2.2}, (5, 4, 2.5, 2.2)),
        ({}, {"camera_angle_x": ANGLE, **TWICE}, (5, 4, 2.5, 2.2)),
        ({"cx": 2.5}, {"camera_angle_x": ANGLE}, (5, 5, 2.5, 2)),
        ({}, {"camera_angle_x": ANGLE, "fl_x": 5, "fl_y": 4, "camera_angle_y": DOWN}, (5, 4, 3, 2)),
        ({}, {"camera_angle_y": DOWN}, (4, 4, 3, 2)),
        ({}, {"camera_angle_x": ANGLE, "camera_angle_y": 2.0 * math.atan(0.5 * 4 / 4.98)}, (5, 4.98, 3, 2)),
        ({"fl_x": 7}, {"fl_x": 5, "cy": 2.2}, (7, 7, 3, 2.2)),
        ({"fl_x": 7}, {"camera_intrinsics": [2.5, 2.2, 5, 4]}, (7, 7, 3, 2)),
        ({"camera_intrinsics": [2.5, 2.2, 5, 4]}, {"fl_x": 7}, (5, 4, 2.5, 2.2)),
    ],
)
def test_what_is_stated_is_the_camera(
    dataset: Path, change: Change, frame: dict, shared: dict, expected: tuple[float, ...]
) -> None:
    camera = _camera(dataset, change, frame, shared)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("shared", "message"),
    [
        ({"camera_angle_x": 1.02 * ANGLE, "fl_x": 5}, r"camera_angle_x: .*same field.*beside a focal length of 5 in"),
        ({"camera_angle_x": "wide", "fl_x": 5}, "camera_angle_x: expected radians between 1e-06 and π, found 'wide'"),
        ({"camera_angle_x": 40.0}, r"camera_angle_x: expected radians .* found 40\.0\. Of degrees write 0\.698132\."),
        ({"camera_angle_x": ANGLE, "camera_angle_y": DOWN}, "camera_angle_y: .*same field.*where it is 0.76101"),
        ({"camera_angle_x": ANGLE, "fl_y": 5, "camera_angle_y": DOWN}, "camera_angle_y: expected the same field"),
        ({"camera_angle_x": ANGLE, "w": 4, "h": 6}, r"w, h: expected the shape of the image, 6 × 4, found 4 × 6"),
        ({"cx": 3, "cy": 2}, '"fl_x" or "camera_angle_x", too, found cx, cy'),
        ({"fl_x": "5"}, 'a finite number under "fl_x"'),
        ({**TWICE, "h": 12}, r"w, h: expected the shape of the image, 6 × 4, found 12 × 12"),
        ({**TWICE, "w": 0}, "w, h: expected the shape of the image"),
        ({"fl_x": -5}, "fl_x: expected focal lengths in pixels, above 0"),
        ({"fl_x": 5, "cx": 1e3}, "principal point"),
        ({"fl_x": 5, "cx": 6, "cy": 4}, "image whose middle"),
    ],
)
def test_what_no_camera_has_is_refused(dataset: Path, change: Change, shared: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _camera(dataset, change, {}, shared)
