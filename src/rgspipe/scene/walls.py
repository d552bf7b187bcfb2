"""The flat surfaces near a point, as surfels have them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.scene.surfels import Surfels

#: Surfels of one wall: normals within this cosine (11°), centres within so many of their scales of its plane.
SAME_NORMAL, SAME_PLANE = 0.98, 2.0

#: The part of the scene's size within which surfels tell what a wall is like.
REACH = 0.15


@dataclass(frozen=True)
class Wall:
    """A flat surface.

    Attributes:
        place: (3,) float64 the point of it that was asked about.
        normal: (3,) float64 of unit length, to where it is seen from.
    """

    place: Tensor
    normal: Tensor


def walls_near(surfels: Surfels, point: Tensor, size: float, count: int, facing: Tensor | None = None) -> list[Wall]:
    """At most `count` walls that a point (3,) is nearest to, the nearest first; of those that face a way, if one (3,)
    is given: within 45° of it.

    Surfels are noisy, so the plane is that of all that lie in it around the nearest one.
    """
    centers, normals = surfels.centers.double().cpu(), surfels.normals.double().cpu()
    scales = surfels.scales.double().cpu().amax(dim=1)
    distance = (centers - point).norm(dim=1)
    if facing is not None:
        distance = torch.where(normals @ facing.to(normals) > math.sqrt(0.5), distance, torch.inf)
    left, walls = distance < max(REACH * size, float(distance.min()) * 2.0), []
    while len(walls) < count and bool(left.any()):
        nearest = int(torch.where(left, distance, torch.inf).argmin())
        height = (centers - centers[nearest]) @ normals[nearest]
        members = (normals @ normals[nearest] > SAME_NORMAL) & (height.abs() < SAME_PLANE * scales) & left
        normal = torch.nn.functional.normalize(normals[members].mean(dim=0), dim=0)
        above = ((point - centers[members]) @ normal).median()
        walls.append(Wall(point - above * normal, normal))
        left = left & ~members & (normals @ normal < SAME_NORMAL)
    return walls
