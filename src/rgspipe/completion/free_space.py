"""Which part of a scene's bounding box its cameras look through (space carving, Kutulakos and Seitz 2000)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import torch
from torch import Tensor

from rgspipe.completion.depth_views import DepthViews
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Camera

#: Most pixels along a side that are traced of a camera.
LONGEST_SIDE = 96

#: Cameras that are asked at once: few calls for few points, and what the first ones see need not be asked the others.
AT_ONCE = 8

#: Most cells along a side of a grid.
MOST_CELLS = 128


@dataclass(frozen=True)
class Grid:
    """Cells of a box.

    Attributes:
        lower: (3,) float64 corner of the first cell.
        cell: (3,) float64 sides of a cell; nearly equal.
        shape: cells along x, y and z.
    """

    lower: Tensor
    cell: Tensor
    shape: tuple[int, int, int]

    @classmethod
    def over(cls, lower: Tensor, upper: Tensor, edge: float) -> Grid:
        """Cells of about `edge` between two corners (3,), MOST_CELLS along the longest side at most."""
        extent = (upper - lower).double()
        edge = max(edge, float(extent.max()) / MOST_CELLS)
        shape = (extent / edge).round().clamp(min=2).long()
        # A box may be flat.
        return cls(lower.double(), (extent / shape).clamp(min=1e-9 * edge), tuple(shape.tolist()))

    @property
    def centers(self) -> Tensor:
        """(X · Y · Z, 3) float64 middles of the cells."""
        index = torch.cartesian_prod(*(torch.arange(count, dtype=torch.float64) for count in self.shape))
        return self.lower + (index + 0.5) * self.cell

    @property
    def upper(self) -> Tensor:
        """(3,) float64 corner of the last cell."""
        return self.lower + self.cell * torch.tensor(self.shape)

    def contains(self, places: np.ndarray) -> np.ndarray:
        """(P,) bool: whether places (P, 3) are in the box."""
        return ((places >= self.lower.numpy()) & (places <= self.upper.numpy())).all(axis=1)

    def at(self, values: np.ndarray, places: np.ndarray) -> np.ndarray:
        """(P,) what the cells of places (P, 3) have among `values` (X, Y, Z); outside of the box the nearest cell."""
        index = np.floor((places - self.lower.numpy()) / self.cell.numpy()).astype(np.int64)
        return values[tuple(index.clip(0, np.array(self.shape) - 1).T)]


@dataclass(frozen=True)
class SeenSpace:
    """How far cameras look.

    Attributes:
        cameras: of images with LONGEST_SIDE pixels along a side at most.
        reaches: for each of them (H · W,) float64, the distance at which the ray of each pixel ends.
        depth_views: the photographs whose depth is known, as they are.
    """

    cameras: tuple[Camera, ...]
    reaches: tuple[Tensor, ...]
    depth_views: DepthViews

    @classmethod
    def of(cls, bvh: SurfelBvh, cameras: Sequence[Camera], depths: Sequence[Tensor | None] = ()) -> SeenSpace:
        """What is seen past the surfaces, both of whose sides end a ray.

        Args:
            depths: of each camera the depth (H, W) of its photograph if it is known, at which rays end as well: a place
                that has no surfel, as one camera alone saw it aslant, is no hole.
        """
        reduced = tuple(camera.reduced(LONGEST_SIDE) for camera in cameras)
        known = depths or [None] * len(reduced)
        reaches = tuple(_reach(bvh, *one) for one in zip(reduced, known, strict=True))
        return cls(reduced, reaches, DepthViews.of(cameras, known))

    def holds(self, points: Tensor, margin: float, *, around: bool = False) -> Tensor:
        """(P,) bool: points (P, 3) that lie nearer to a camera, by `margin`, than the surface behind them.

        Args:
            around: the surface is that which is nearest of what the four rays around a point meet, or else that of its
                own pixel. Beside the edge of a thing this one's ray may go past it, and that through the point not.
        """
        free = torch.zeros(len(points), dtype=torch.bool)
        for first in range(0, len(self.cameras), AT_ONCE):
            unseen = (~free).nonzero()[:, 0]
            free[unseen] = self._seen_by_some(slice(first, first + AT_ONCE), points[unseen].double(), margin, around)
        return free

    def _seen_by_some(self, cameras: slice, points: Tensor, margin: float, around: bool) -> Tensor:
        """(P,) bool: what some of the cameras (C,) see of points (P, 3), as in `holds`."""
        origins, rotations, lenses, sizes, starts, reaches = self._stacked
        fx, fy, cx, cy = lenses[cameras, :, None].unbind(1)
        width, height = sizes[cameras, :, None].unbind(1)
        # As `Camera.project` has it.
        local = (points - origins[cameras, None]) @ rotations[cameras]
        depth = -local[:, :, 2]
        scale = 1.0 / torch.where(depth.abs() > 1e-12, depth, 1e-12)
        u, v = cx + fx * local[:, :, 0] * scale, cy - fy * local[:, :, 1] * scale
        framed = (depth > 0) & (u >= 0.0) & (u < width) & (v >= 0.0) & (v < height)
        reach = torch.full_like(depth, torch.inf)
        for across, down in product((-0.5, 0.5), repeat=2) if around else [(0.0, 0.0)]:
            column, row = (u + across).floor().clamp(min=0.0), (v + down).floor().clamp(min=0.0)
            inside = torch.minimum(row, height - 1.0) * width + torch.minimum(column, width - 1.0)
            pixel = starts[cameras, None] + torch.where(framed, inside, 0.0).long()
            reach = torch.minimum(reach, reaches[pixel])
        return (framed & (local.norm(dim=2) < reach - margin)).any(dim=0)

    @cached_property
    def _stacked(self) -> tuple[Tensor, ...]:
        """Of all cameras, float64: origins (V, 3), rotations (V, 3, 3), fx, fy, cx and cy (V, 4), widths and heights
        (V, 2), where (V,) the pixels of each begin among all reaches (R,), and these."""
        poses = torch.stack([camera.camera_to_world.double() for camera in self.cameras])
        lenses = [[camera.fx, camera.fy, camera.cx, camera.cy] for camera in self.cameras]
        sizes = torch.tensor([[camera.width, camera.height] for camera in self.cameras])
        pixels = sizes.prod(dim=1)
        lenses, starts = torch.tensor(lenses, dtype=torch.float64), pixels.cumsum(dim=0) - pixels
        return poses[:, :3, 3], poses[:, :3, :3], lenses, sizes.double(), starts, torch.cat(self.reaches)

    def cells(self, grid: Grid, margin: float) -> Tensor:
        """(X, Y, Z) bool: cells whose middles were seen."""
        return self.holds(grid.centers, margin).reshape(grid.shape)


def _reach(bvh: SurfelBvh, camera: Camera, depth: Tensor | None) -> Tensor:
    """(H · W,) float64 distance at which the ray of each pixel ends; infinite where most of it ends nowhere."""
    origins, directions, lengths = camera.rays()
    hits = composite(bvh, origins, directions, two_sided=True)
    covered = hits.weights.sum(dim=1)
    mean = (hits.weights * hits.depths.nan_to_num(posinf=0.0)).sum(dim=1) / covered.clamp(min=1e-6)
    reach = torch.where(hits.transmittance < 0.5, mean.double(), torch.inf)
    if depth is not None:
        measured = lengths.double().reshape(-1) * _sampled(depth.double(), camera)
        reach = torch.minimum(reach, torch.where(measured.isfinite(), measured, torch.inf).to(reach.device))
    return reach.cpu()


def _sampled(depth: Tensor, camera: Camera) -> Tensor:
    """(h · w,) what an image (H, W) has at the middles of the pixels of a camera that was reduced."""
    rows, columns = (
        ((torch.arange(small) + 0.5) * large / small).long()
        for small, large in zip((camera.height, camera.width), depth.shape, strict=True)
    )
    return depth[rows][:, columns].reshape(-1)
