"""A lit tabletop whose images are known in closed form."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.benchmark.rooms import Room
from rgspipe.scene.rectangles import rectangle

#: A floor with a dark tile; nothing about it is symmetric.
FLOOR, TILE = [0.2, 0.5, 0.8], [0.05, 0.1, 0.1]
TABLETOP = Room(
    "tabletop",
    rectangle([-4, -4, 0], [8, 0, 0], [0, 8, 0], FLOOR) + rectangle([0.1, 0.1, 0.001], [0.5, 0, 0], [0, 0.2, 0], TILE),
    torch.tensor([[[0.5, -1.0, 1.5], [0.0, 0.0, 0.0]], [[-0.6, 0.2, 1.2], [0.2, 0.1, 0.0]]]),
    torch.tensor([[0.1, -0.2, 0.9], [-0.5, 0.4, 0.6]]),
)


def lit_tabletop(camera: int, light: int, size: int, move: Tensor | None = None) -> Tensor:
    """(size, size, 3) L = ρ/π · cosθ/r², the mean over 16 × 16 rays a pixel; the light moved by `move` (3,)."""
    origins, directions, _ = TABLETOP.cameras(size)[camera].rays(subsamples=16)
    points = origins - (origins[:, 2:] / directions[:, 2:]) * directions
    position = TABLETOP.lights[light].double()
    offset = (position if move is None else position + move) - points
    x, y = points[:, 0], points[:, 1]
    on_tile = (x > 0.1) & (x < 0.6) & (y > 0.1) & (y < 0.3)
    albedo = torch.where(on_tile[:, None], torch.tensor(TILE), torch.tensor(FLOOR)).double()
    radiance = albedo / math.pi * (offset[:, 2] / offset.norm(dim=1) ** 3)[:, None]
    return radiance.reshape(size, size, 256, 3).mean(dim=2)
