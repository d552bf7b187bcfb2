"""Small surfel scenes with known geometry, for the tests."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.scene import NO_CLIP, Coverage, Surfels
from rgspipe.scene.surfels import quaternion_from_normal


def surfels_on(points: Tensor, normals: Tensor, spacing: float, albedo: Tensor | float = 0.5) -> Surfels:
    """Round, nearly opaque surfels of one spacing at points (N, 3) with normals (N, 3)."""
    count = len(points)
    colour = torch.as_tensor(albedo, dtype=torch.float64).expand(count, 3).clone()
    return Surfels(
        centers=points.double(),
        rotations=quaternion_from_normal(normals.double()),
        scales=torch.full((count, 2), 0.6 * spacing, dtype=torch.float64),
        opacities=torch.full((count,), 0.95, dtype=torch.float64),
        albedo=colour,
        clip_offsets=torch.full((count, 2), NO_CLIP, dtype=torch.float64),
        clip_angles=torch.zeros((count, 2), dtype=torch.float64),
        coverage=Coverage(low=0.5, high=0.9, layer_thickness=0.6 * spacing, clip_softness=0.12 * spacing),
    )


def rectangle(origin: list[float], side_a: list[float], side_b: list[float], spacing: float) -> tuple[Tensor, Tensor]:
    """Cell centres of a grid over a rectangle, and its normal a × b repeated."""
    o, a, b = (torch.tensor(x, dtype=torch.float64) for x in (origin, side_a, side_b))
    na, nb = max(1, round(float(a.norm()) / spacing)), max(1, round(float(b.norm()) / spacing))
    u, v = torch.meshgrid((torch.arange(na) + 0.5) / na, (torch.arange(nb) + 0.5) / nb, indexing="ij")
    points = o + u.reshape(-1, 1) * a + v.reshape(-1, 1) * b
    normal = torch.nn.functional.normalize(torch.linalg.cross(a, b), dim=0)
    return points, normal.expand_as(points)


def closed_box(spacing: float, albedo: float = 0.5, size: float = 1.0) -> Surfels:
    """The inside of a cube centred at the origin."""
    h = 0.5 * size
    faces = [
        ([-h, -h, -h], [size, 0, 0], [0, size, 0]),
        ([-h, -h, h], [0, size, 0], [size, 0, 0]),
        ([-h, -h, -h], [0, 0, size], [size, 0, 0]),
        ([-h, h, -h], [size, 0, 0], [0, 0, size]),
        ([-h, -h, -h], [0, size, 0], [0, 0, size]),
        ([h, -h, -h], [0, 0, size], [0, size, 0]),
    ]
    parts = [rectangle(*face, spacing * size) for face in faces]
    points, normals = (torch.cat(x) for x in zip(*parts, strict=True))
    return surfels_on(points, normals, spacing * size, albedo)


def sphere(count: int, albedo: float = 0.5, radius: float = 1.0) -> Surfels:
    """The inside of a sphere, surfels on a Fibonacci lattice."""
    k = torch.arange(count, dtype=torch.float64) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = math.pi * (1.0 + math.sqrt(5.0)) * k
    ring = (1.0 - z * z).sqrt()
    points = torch.stack([ring * angle.cos(), ring * angle.sin(), z], dim=1)
    return surfels_on(radius * points, -points, radius * math.sqrt(4.0 * math.pi / count), albedo)
