"""Point sets for sampling hemispheres, and the directions that they stand for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import torch
from torch import Tensor

PointSet = Literal["golden", "r2", "sobol", "jittered", "random"]

#: Share of a turn between successive points: no two multiples of it come close, whatever the number of points.
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0

#: Generalised golden ratio of two dimensions (Roberts 2018).
R2 = 1.32471795724474602596


def point_set(kind: PointSet, surfels: int, rays: int, generator: torch.Generator) -> Tensor:
    """(surfels, rays, 2) float64 points of the unit square, randomised for every surfel on its own.

    Every set is unbiased: a point is equally likely anywhere.

    - `golden`: ((k + a)/M, k·φ + b): under `cosine_directions` the seeds of a sunflower on the projected hemisphere.
    - `r2`: the R₂ sequence, shifted.
    - `sobol`: Sobol's sequence with a random scrambling (Owen 1998) for every surfel.
    - `jittered`: one point in each cell of a grid of about √M × √M cells.
    - `random`: independent points.
    """
    return _SETS[kind](surfels, rays, generator)


def cosine_directions(axes: Tensor, rays: int, generator: torch.Generator, points: PointSet = "golden") -> Tensor:
    """(N, rays, 3) unit directions, cosine-distributed around the normals axes[:, 2] of frames (N, 3, 3).

    A point's first coordinate is the squared radius on the projected hemisphere (Malley's method), its second
    the share of a turn.
    """
    u = point_set(points, len(axes), rays, generator).to(axes.device, axes.dtype)
    radius, angle = u[..., 0].sqrt(), 2.0 * math.pi * u[..., 1]
    height = (1.0 - u[..., 0]).clamp(min=1e-5).sqrt()
    local = torch.stack([radius * angle.cos(), radius * angle.sin(), height], dim=-1)
    return torch.nn.functional.normalize(local @ axes, dim=-1)


def neighbour_angle(count: int) -> float:
    """How far apart `count` evenly spread directions are [rad]: the side of each one's share of the sphere."""
    return math.sqrt(4.0 * math.pi / count)


def fibonacci_directions(count: int) -> Tensor:
    """(count, 3) float32 unit vectors, spread evenly over the sphere."""
    index = torch.arange(count, dtype=torch.float64)
    height = 1.0 - (2.0 * index + 1.0) / count
    turn = index * math.pi * (3.0 - math.sqrt(5.0))
    across = (1.0 - height.square()).sqrt()
    return torch.stack([across * turn.cos(), across * turn.sin(), height], dim=1).float()


def _golden(surfels: int, rays: int, generator: torch.Generator) -> Tensor:
    k, shift = torch.arange(rays, dtype=torch.float64), _uniform(surfels, 1, generator)
    return torch.stack([(k + shift[..., 0]) / rays, (k * GOLDEN + shift[..., 1]) % 1.0], dim=-1)


def _r2(surfels: int, rays: int, generator: torch.Generator) -> Tensor:
    k = torch.arange(1, rays + 1, dtype=torch.float64)
    points = torch.stack([k / R2, k / R2**2], dim=-1)
    return (points + _uniform(surfels, 1, generator)) % 1.0


def _sobol(surfels: int, rays: int, generator: torch.Generator) -> Tensor:
    seeds = torch.randint(2**31, (surfels,), generator=generator).tolist()
    engines = (torch.quasirandom.SobolEngine(2, scramble=True, seed=seed) for seed in seeds)
    parts = [engine.draw(rays, dtype=torch.float64) for engine in engines]
    return torch.stack(parts) if parts else torch.zeros(0, rays, 2, dtype=torch.float64)


def _jittered(surfels: int, rays: int, generator: torch.Generator) -> Tensor:
    columns = next(n for n in range(math.isqrt(rays), 0, -1) if rays % n == 0)
    k = torch.arange(rays)
    cells = torch.stack([k // columns, k % columns], dim=-1)
    return (cells + _uniform(surfels, rays, generator)) / torch.tensor([rays // columns, columns])


def _uniform(surfels: int, rays: int, generator: torch.Generator) -> Tensor:
    return torch.rand((surfels, rays, 2), generator=generator, dtype=torch.float64)


_SETS: dict[PointSet, Callable[[int, int, torch.Generator], Tensor]] = {
    "golden": _golden,
    "r2": _r2,
    "sobol": _sobol,
    "jittered": _jittered,
    "random": _uniform,
}
