"""Cameras that files describe by their field of view."""

from __future__ import annotations

import math

from torch import Tensor

from rgspipe.datasets.json_file import is_number, shown
from rgspipe.errors import InputError
from rgspipe.scene import Camera
from rgspipe.scene.camera import NARROWEST


def camera_of_angle(pose: Tensor, angle: object, width: int, height: int, place: str) -> Camera:
    """A camera with square pixels and `angle` radians across its width.

    Args:
        pose: (4, 4) camera to world.
        place: file and key of the angle.

    Raises:
        InputError: no lens has this angle.
    """
    focal = focal_of_angle(angle, width, place)
    return Camera(pose, focal, focal, 0.5 * width, 0.5 * height, width, height)


def focal_of_angle(angle: object, size: float, place: str) -> float:
    """The focal length, in pixels, with which `angle` radians are `size` pixels wide.

    Raises:
        InputError: no lens has this angle; names its `place`.
    """
    if not is_number(angle) or not NARROWEST <= angle < math.pi:
        expected = f"radians between {NARROWEST:g} and π"
        degrees = is_number(angle) and math.pi <= angle < 180.0
        remedy = f"Of degrees write {math.radians(float(angle)):.6g}." if degrees else "Correct it."
        raise InputError(place, expected=expected, found=shown(angle), remedy=remedy)
    return 0.5 * size / math.tan(0.5 * float(angle))
