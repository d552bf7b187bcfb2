"""Scenes made of rectangles: exact geometry that surfels, Cycles and other renderers can all be given."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from rgspipe.scene.surfels import NO_CLIP, Coverage, Surfels

#: Standard deviation of a surfel over the spacing of its grid.
SCALE = 0.6

#: Layer thickness over the spacing.
LAYER = 0.6

#: Opacity of a surfel, and the raw coverages at which a layer is empty and opaque: so low that the corner of a
#: rectangle, which one surfel covers with 0.48, is opaque. Footprints end at edges, so no tail needs to be cut.
OPACITY, THRESHOLDS = 0.96, (0.1, 0.4)

#: Opacity below which such a surfel ends, where its neighbours cover anyway. At 0.01, the default, footprints are half
#: as large again, rays cost 15 % more, and images are no better.
MINIMUM_ALPHA = 0.05

#: Width of the ramp at an edge over the spacing.
EDGE_SOFTNESS = 0.05


@dataclass(frozen=True)
class Rectangles:
    """Q rectangles that reflect diffusely; float64.

    Attributes:
        origins: (Q, 3) one corner of each, scene units.
        sides_a, sides_b: (Q, 3) its two sides, perpendicular; the front's normal is a × b.
        albedo: (Q, 3) diffuse reflectance.
    """

    origins: Tensor
    sides_a: Tensor
    sides_b: Tensor
    albedo: Tensor

    def __len__(self) -> int:
        return self.origins.shape[0]

    def __add__(self, other: Rectangles) -> Rectangles:
        joined = {f.name: torch.cat([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self)}
        return Rectangles(**joined)

    @property
    def corners(self) -> Tensor:
        """(Q, 4, 3) corners, counter-clockwise as seen from the front."""
        o, a, b = self.origins, self.sides_a, self.sides_b
        return torch.stack([o, o + a, o + a + b, o + b], dim=1)

    @property
    def areas(self) -> Tensor:
        """(Q,) scene units²."""
        return self.sides_a.norm(dim=1) * self.sides_b.norm(dim=1)


def rectangle(
    origin: Sequence[float], side_a: Sequence[float], side_b: Sequence[float], albedo: Sequence[float]
) -> Rectangles:
    """One rectangle."""
    return Rectangles(*(torch.tensor([x], dtype=torch.float64) for x in (origin, side_a, side_b, albedo)))


def solid_box(center: Sequence[float], size: Sequence[float], albedo: Sequence[float], turn: float = 0.0) -> Rectangles:
    """The outside of a box, turned about +z by `turn` [rad]."""
    x, y, z = torch.diag(torch.tensor(size, dtype=torch.float64))
    middle = torch.tensor(center, dtype=torch.float64)
    low = -0.5 * (x + y + z)
    faces = [(low, y, x), (low + z, x, y), (low, x, z), (low + y, z, x), (low, z, y), (low + x, y, z)]
    c, s = math.cos(turn), math.sin(turn)
    rotation = torch.tensor([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    origins, sides_a, sides_b = (torch.stack(part) @ rotation for part in zip(*faces, strict=True))
    colour = torch.tensor(albedo, dtype=torch.float64).expand(6, 3).clone()
    return Rectangles(origins + middle, sides_a, sides_b, colour)


def inside_of_box(center: Sequence[float], size: Sequence[float], albedo: Sequence[float]) -> Rectangles:
    """The same box seen from inside: a closed room."""
    outside = solid_box(center, size, albedo)
    return Rectangles(outside.origins, outside.sides_b, outside.sides_a, outside.albedo)


def surfels_on(rectangles: Rectangles, count: int) -> Surfels:
    """About `count` surfels with the exact geometry and albedo of `rectangles`, on grids that fit their sides.

    Each surfel is cut at the edges of its rectangle, so that surfaces end where the rectangles do.
    """
    spacing = math.sqrt(float(rectangles.areas.sum()) / count)
    parts = [_grid(rectangles, index, spacing) for index in range(len(rectangles))]
    tensors = {name: torch.cat([part[name] for part in parts]) for name in parts[0]}
    total = len(tensors["centers"])
    coverage = Coverage(*THRESHOLDS, LAYER * spacing, EDGE_SOFTNESS * spacing, MINIMUM_ALPHA)
    return Surfels(opacities=torch.full((total,), OPACITY, dtype=torch.float64), coverage=coverage, **tensors)


def _grid(rectangles: Rectangles, index: int, spacing: float) -> dict[str, Tensor]:
    """Surfels of one rectangle: u along side a, v along side b."""
    origin, a, b = rectangles.origins[index], rectangles.sides_a[index], rectangles.sides_b[index]
    lengths = torch.stack([a.norm(), b.norm()])
    cells = [max(2, round(float(length) / spacing)) for length in lengths]
    i, j = torch.meshgrid(*(torch.arange(n, dtype=torch.float64) + 0.5 for n in cells), indexing="ij")
    place = torch.stack([i.reshape(-1) / cells[0], j.reshape(-1) / cells[1]], dim=1)
    count = len(place)
    u, v = a / lengths[0], b / lengths[1]
    axes = torch.stack([u, v, torch.linalg.cross(u, v)], dim=1)
    quaternion = torch.from_numpy(Rotation.from_matrix(axes.numpy()).as_quat(scalar_first=True))
    step = lengths / torch.tensor(cells)
    near_low = place < 0.5
    distance = torch.where(near_low, place, 1.0 - place) * lengths
    turned = torch.where(near_low, math.pi, 0.0) + torch.tensor([0.0, 0.5 * math.pi], dtype=torch.float64)
    return {
        "centers": origin + place[:, :1] * a + place[:, 1:] * b,
        "rotations": quaternion.expand(count, 4).clone(),
        "scales": (SCALE * step).expand(count, 2).clone(),
        "albedo": rectangles.albedo[index].expand(count, 3).clone(),
        "clip_offsets": torch.where(distance < 6.0 * step, distance, torch.full_like(distance, NO_CLIP)),
        "clip_angles": turned,
    }
