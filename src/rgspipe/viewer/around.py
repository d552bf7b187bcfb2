"""Cameras from where a scene could be looked at as well."""

from __future__ import annotations

import math

import torch

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, look_at

#: Directions around the vertical, and heights above the middle, of the scene's height.
DIRECTIONS, HEIGHTS = 8, (-0.25, 0.25)


def cameras_around(frozen: FrozenScene, like: Camera) -> list[tuple[str, Camera]]:
    """Named cameras with the lens of one, as far from the scene's middle as that, aimed at it from all sides."""
    lower, upper = (corner.double().cpu() for corner in frozen.bounds)
    middle, high = 0.5 * (lower + upper), float(upper[2] - lower[2])
    away = like.origin - middle
    distance = math.hypot(float(away[0]), float(away[1])) or float(away.norm()) or 1.0
    begin = math.atan2(float(away[1]), float(away[0]))
    numbers = (like.fx, like.fy, like.cx, like.cy, like.width, like.height)
    found = []
    for step in range(DIRECTIONS):
        turn = begin + 2.0 * math.pi * step / DIRECTIONS
        for height in HEIGHTS:
            offset = torch.tensor(
                [distance * math.cos(turn), distance * math.sin(turn), height * high], dtype=torch.float64
            )
            degrees = round(360.0 * step / DIRECTIONS)
            name = f"{degrees}° around, {'above' if height > 0 else 'below'}"
            found.append((name, Camera(look_at(middle + offset, middle), *numbers)))
    return found
