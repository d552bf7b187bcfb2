"""Which pixels of a view an edge of the geometry crosses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits, composite
from rgspipe.renderer.kernels.surface import mean_surface
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.camera import Camera

#: Rays whose mean normals differ by more (L1) meet different surfaces.
NORMAL_JUMP = 0.3

#: … and so do those whose inverse depths differ by more than this part.
DEPTH_JUMP = 0.12

#: … or whose coverages differ by more.
COVERAGE_JUMP = 0.3


@dataclass(frozen=True)
class Seen:
    """What rays through a camera's pixels see, of any leading shape; on the CPU.

    Attributes:
        normal: (…, 3) mean normal of the surface; shorter than 1 where a ray meets several.
        inverse: (…,) inverse planar depth.
        passing: (…,) share of the ray that passes every surface.
    """

    normal: Tensor
    inverse: Tensor
    passing: Tensor

    @classmethod
    def of(cls, bvh: SurfelBvh, hits: Hits, lengths: Tensor) -> Seen:
        """Of R rays with `lengths` (R,) per unit of planar depth."""
        normal, distance = mean_surface(hits, bvh.surfels.normals.float())
        inverse = lengths.float() / distance.cpu().clamp(min=1e-6)
        return cls(normal.cpu(), inverse, hits.transmittance.cpu())

    @classmethod
    def joined(cls, parts: Sequence[Seen]) -> Seen:
        """One after the other."""
        return cls(*(torch.cat([getattr(part, name) for part in parts]) for name in ("normal", "inverse", "passing")))

    def reshape(self, *shape: int) -> Seen:
        """The same in another leading shape."""
        return Seen(self.normal.reshape(*shape, 3), self.inverse.reshape(shape), self.passing.reshape(shape))

    def __getitem__(self, index: Tensor | tuple[slice | Tensor | None, ...]) -> Seen:
        return Seen(self.normal[index], self.inverse[index], self.passing[index])

    @property
    def divided(self) -> Tensor:
        """(…,) bool: the ray itself meets an edge: a part passes, or surfaces of two normals share it."""
        partly = (self.passing > 0.02) & (self.passing < 0.98)
        return partly | ((self.normal.norm(dim=-1) < 0.95) & (self.passing < 0.5))

    def differs(self, other: Seen) -> Tensor:
        """(…,) bool: the two see different surfaces."""
        jump = (self.normal - other.normal).abs().sum(dim=-1) > NORMAL_JUMP
        jump |= (self.passing - other.passing).abs() > COVERAGE_JUMP
        deeper = (self.inverse - other.inverse).abs() > DEPTH_JUMP * torch.minimum(self.inverse, other.inverse)
        return jump | (deeper & (self.passing < 0.5) & (other.passing < 0.5))


def pixels_beside_edges(seen: Seen) -> Tensor:
    """(height, width) bool: pixels whose centre, in `seen` (height, width), differs from that of a neighbour.

    A straight edge that crosses a pixel parts its centre from that of one of its four neighbours, so these hold all
    that such an edge crosses, and as many that it only passes by.
    """
    beside = seen.divided
    every, first, last = slice(None), slice(None, -1), slice(1, None)
    for low, high in (((first,), (last,)), ((every, first), (every, last))):
        jump = seen[low].differs(seen[high])
        beside[low] |= jump
        beside[high] |= jump
    return beside


def pixels_on_edges(bvh: SurfelBvh, camera: Camera, seen: Seen, beside: Tensor, nearest: float) -> Tensor:
    """(K,) int64 flat indices of the pixels `beside` an edge that it crosses: a corner sees another surface.

    Args:
        seen: (height, width) of the centres.
        beside: (height, width) bool.
        nearest: hits nearer than this do not count, scene units.
    """
    row, column = beside.nonzero(as_tuple=True)
    # The corners of the pixels are the pixel centres of this camera.
    shifted = replace(camera, cx=camera.cx + 0.5, cy=camera.cy + 0.5, width=camera.width + 1, height=camera.height + 1)
    corners = torch.stack([(row + i) * shifted.width + column + j for i in (0, 1) for j in (0, 1)], dim=1)
    # Neighbours share corners.
    cast, back = corners.unique(return_inverse=True)
    origins, directions, lengths = shifted.rays(cast)
    found = Seen.of(bvh, composite(bvh, origins, directions, nearest=nearest), lengths)[back]
    centre = seen[row, column]
    other = found.divided | found.differs(centre[:, None])
    return (row * camera.width + column)[centre.divided | other.any(dim=1)]
