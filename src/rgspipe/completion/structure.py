"""What a room's flat surfaces become where no camera looked: they go on until something ends them.

A surface that ends in sight shows what is beyond its edge: rays past the edge cross its plane. Where no ray does, and
the surface ends only as the frames of the cameras do, or behind something, it goes on; so do walls, floor and ceiling,
until they meet. The side from which the cameras looked is closed right behind them if what was continued leads there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import binary_dilation, binary_opening, label
from scipy.spatial import cKDTree

from rgspipe.completion.free_space import Grid, SeenSpace
from rgspipe.completion.planes import Plane

#: A place of a plane has a surface if a surfel is within so many distances of neighbours.
BARE = 1.1

#: How far behind a plane a camera must see for its ray to have crossed the plane, in distances of neighbours: rays that
#: graze a wall from inside a room pass nearer to it than surfels are apart.
BEYOND = 0.5


@dataclass(frozen=True)
class Continued:
    """Places of surfaces that were continued, one distance of neighbours apart.

    Attributes:
        places: (G, 3) float64, scene units.
        normals: (G, 3) unit.
    """

    places: np.ndarray
    normals: np.ndarray

    def __len__(self) -> int:
        return len(self.places)

    def chosen(self, which: np.ndarray) -> Continued:
        """Some of them."""
        return Continued(self.places[which], self.normals[which])

    @staticmethod
    def joined(parts: list[Continued]) -> Continued:
        """All of several."""
        empty = np.empty((0, 3))
        return Continued(
            np.concatenate([empty, *(part.places for part in parts)]),
            np.concatenate([empty, *(part.normals for part in parts)]),
        )


def continued(planes: Sequence[Plane], centers: np.ndarray, grid: Grid, space: SeenSpace, spacing: float) -> Continued:
    """What the planes of surfels become where nothing was seen, and the sides of the grid's box that they lead to.

    Args:
        planes: of surfels at `centers` (N, 3).
        grid: its box is all that there is.
        space: what cameras looked through.
    """
    surfaces = cKDTree(centers)
    parts = [_beyond(plane, cKDTree(centers[plane.members.numpy()]), grid, space, spacing) for plane in planes]
    inner = Continued.joined(parts)
    known = cKDTree(np.concatenate([centers, inner.places]))
    sides = [_side(axis, end, surfaces, known, grid, space, spacing) for axis in range(3) for end in (0, 1)]
    return Continued.joined([inner, *sides])


def _beyond(plane: Plane, members: cKDTree, grid: Grid, space: SeenSpace, spacing: float) -> Continued:
    """The places of a plane within the box that its surfels border on more than what cameras saw through does."""
    normal = plane.normal.numpy()
    raster = _Raster.on_plane(normal, plane.offset, grid, spacing)
    places = raster.places
    supported = (members.query(places)[0] <= BARE * spacing).reshape(raster.shape)
    within, pierced = _within(raster, normal, grid), _crossed(raster, normal, space, spacing)
    # One place wide it is the blur of an edge.
    unknown = binary_opening(within & ~pierced | supported, np.ones((3, 3))) & ~supported
    return raster.chosen(_parts(unknown, lambda rim: supported[rim].sum() > pierced[rim].sum(), outer=True), normal)


def _side(
    axis: int, end: int, surfaces: cKDTree, known: cKDTree, grid: Grid, space: SeenSpace, spacing: float
) -> Continued:
    """The parts of a side of the box that no camera looked through, where surfaces lead to most of their rim."""
    normal = np.zeros(3)
    normal[axis] = 1.0 - 2.0 * end
    corner = grid.lower.numpy() if end == 0 else grid.upper.numpy()
    raster = _Raster.on_plane(normal, float(normal @ corner), grid, spacing)
    places = raster.places
    unknown = _within(raster, normal, grid) & ~_crossed(raster, normal, space, spacing)
    unknown &= (surfaces.query(places)[0] > BARE * spacing).reshape(raster.shape)
    unknown = binary_opening(unknown, np.ones((3, 3)))
    near = (known.query(places)[0] <= 2.0 * BARE * spacing).reshape(raster.shape)
    return raster.chosen(_parts(unknown, lambda rim: near[rim].mean() > 0.5, outer=False), normal)


def _within(raster: _Raster, normal: np.ndarray, grid: Grid) -> np.ndarray:
    """(A, B) bool: places with room of the box before them; the plane itself may lie in a side of the box."""
    return grid.contains(raster.places + 0.5 * float(grid.cell.mean()) * normal).reshape(raster.shape)


def _crossed(raster: _Raster, normal: np.ndarray, space: SeenSpace, spacing: float) -> np.ndarray:
    """(A, B) bool: places behind which a camera saw something."""
    behind = torch.from_numpy(raster.places - BEYOND * spacing * normal)
    return space.holds(behind, 0.0).numpy().reshape(raster.shape)


def _parts(unknown: np.ndarray, is_kept: Callable[[np.ndarray], bool], outer: bool) -> np.ndarray:
    """The connected parts of `unknown` (A, B) that are to be kept.

    Args:
        is_kept: asked of the rim (A, B) of a part.
        outer: whether the rim is what lies around the part, or else what of the part lies at its edge.
    """
    labels, count = label(unknown)
    kept = np.zeros_like(unknown)
    for index in range(1, count + 1):
        part = labels == index
        rim = binary_dilation(part) & ~part if outer else part & ~_eroded(part)
        if is_kept(rim):
            kept |= part
    return kept


def _eroded(part: np.ndarray) -> np.ndarray:
    return ~binary_dilation(~np.pad(part, 1), np.ones((3, 3)))[1:-1, 1:-1]


@dataclass(frozen=True)
class _Raster:
    """Places on a plane, one distance of neighbours apart, over all of a box.

    Attributes:
        places: (A · B, 3).
        shape: A and B.
    """

    places: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def on_plane(cls, normal: np.ndarray, offset: float, grid: Grid, spacing: float) -> _Raster:
        # In the plane, along the axis that lies in it best, so that rows follow the room.
        along = np.eye(3)[np.abs(normal).argmin()]
        u = along - (along @ normal) * normal
        u /= np.linalg.norm(u)
        v = np.cross(normal, u)
        lower, upper = grid.lower.numpy(), grid.upper.numpy()
        corners = np.stack(np.meshgrid(*zip(lower, upper, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
        steps = []
        for axis in (u, v):
            low, high = (corners @ axis).min(), (corners @ axis).max()
            steps.append(np.arange(low + 0.5 * spacing, high, spacing))
        a, b = np.meshgrid(*steps, indexing="ij")
        places = offset * normal + a[..., None] * u + b[..., None] * v
        return cls(places.reshape(-1, 3), a.shape)

    def chosen(self, which: np.ndarray, normal: np.ndarray) -> Continued:
        places = self.places[which.reshape(-1)]
        return Continued(places, np.broadcast_to(normal, places.shape).copy())
