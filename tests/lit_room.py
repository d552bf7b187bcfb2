"""A closed room with a box in it, frozen, and a camera that cannot see behind the box."""

from __future__ import annotations

from functools import cache

import torch

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, Surfels, look_at
from rooms import closed_box, rectangle, surfels_on

SPACING = 0.07

#: The box: its centre and the length of its sides.
BOX_CENTER, BOX_SIZE = (0.05, 0.05, -0.2), 0.3

#: A light that the camera sees, and one behind the box.
VISIBLE, HIDDEN = (0.1, -0.25, 0.3), (0.32, 0.3, -0.3)


def solid_box(center: tuple[float, float, float], size: float, spacing: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Points and outward normals on a cube."""
    h = 0.5 * size
    faces = [
        ([-h, -h, -h], [0, size, 0], [size, 0, 0]),
        ([-h, -h, h], [size, 0, 0], [0, size, 0]),
        ([-h, -h, -h], [size, 0, 0], [0, 0, size]),
        ([-h, h, -h], [0, 0, size], [size, 0, 0]),
        ([-h, -h, -h], [0, 0, size], [0, size, 0]),
        ([h, -h, -h], [0, size, 0], [0, 0, size]),
    ]
    parts = [rectangle(*face, spacing) for face in faces]
    points, normals = (torch.cat(x) for x in zip(*parts, strict=True))
    return points + torch.tensor(center, dtype=torch.float64), normals


def room_surfels() -> Surfels:
    """1272 surfels of albedo 0.6, 0.5 and 0.4."""
    walls, (points, normals) = closed_box(SPACING), solid_box(BOX_CENTER, BOX_SIZE, SPACING)
    albedo = torch.tensor([0.6, 0.5, 0.4], dtype=torch.float64)
    return surfels_on(torch.cat([walls.centers, points]), torch.cat([walls.normals, normals]), SPACING, albedo)


@cache
def frozen_room() -> FrozenScene:
    """The room, of which no test changes anything: frozen once a process, in 0.4 CPU seconds."""
    return FrozenScene.freeze(room_surfels(), gather_rays=64, patches=150, seed=0)


@cache
def frozen_cube() -> FrozenScene:
    """The outside of a cube of side 0.5, in empty space."""
    albedo = torch.tensor([0.6, 0.5, 0.4], dtype=torch.float64)
    surfels = surfels_on(*solid_box((0.0, 0.0, 0.0), 0.5, 0.05), 0.05, albedo)
    return FrozenScene.freeze(surfels, gather_rays=16, patches=50, seed=0)


def room_cameras(resolution: int) -> list[Camera]:
    """Two cameras near the same edge of the ceiling; neither sees HIDDEN."""
    origins = torch.tensor([[-0.4, -0.4, 0.3], [-0.42, -0.1, 0.25]])
    aim = torch.tensor([0.1, 0.1, -0.1])
    return [Camera.from_field_of_view(look_at(origin, aim), 1.4, resolution, resolution) for origin in origins]
