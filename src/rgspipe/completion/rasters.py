"""Places on planes, and what cameras tell of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from scipy.spatial import cKDTree

from rgspipe.completion.free_space import Grid, SeenSpace
from rgspipe.completion.planes import Plane

#: A place of a plane has a surface if a surfel is within so many distances of neighbours.
BARE = 1.1

#: Neighbours that a surfel has at the distance of neighbours.
NEIGHBOURS = 4

#: Cosine of the angle from which on two surfaces are along each other.
ACROSS = 0.7

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

    @classmethod
    def facing(cls, places: np.ndarray, normal: np.ndarray) -> Self:
        """Of places (G, 3) on a plane with this normal (3,)."""
        return cls(places, np.broadcast_to(normal, places.shape).copy())

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


@dataclass(frozen=True)
class Raster:
    """Places on a plane, one distance of neighbours apart, over all of a box.

    Attributes:
        places: (A · B, 3).
        shape: A and B.
        axes: (2, 3) unit, along which the first and the second index grow.
        normal: (3,) unit.
        spacing: distance of neighbours.
    """

    places: np.ndarray
    shape: tuple[int, int]
    axes: np.ndarray
    normal: np.ndarray
    spacing: float

    @classmethod
    def on_plane(
        cls, normal: np.ndarray, offset: float, grid: Grid, spacing: float, along: np.ndarray | None = None
    ) -> Raster:
        """Over all of a box; rows follow `along` (3,), or else the room's axis that lies in the plane best."""
        along = np.eye(3)[np.abs(normal).argmin()] if along is None else along
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
        return cls(places.reshape(-1, 3), a.shape, np.stack([u, v]), normal, spacing)

    def chosen(self, which: np.ndarray) -> Continued:
        """The places of `which` (A, B), bool."""
        return Continued.facing(self.places[which.reshape(-1)], self.normal)

    def within(self, grid: Grid) -> np.ndarray:
        """(A, B) bool: places with room of the box before them; the plane itself may lie in a side of the box."""
        return grid.contains(self.places + 0.5 * float(grid.cell.mean()) * self.normal).reshape(self.shape)

    def crossed(self, space: SeenSpace) -> np.ndarray:
        """(A, B) bool: places behind which a camera saw something."""
        behind = torch.from_numpy(self.places - BEYOND * self.spacing * self.normal)
        return space.holds(behind, 0.0).numpy().reshape(self.shape)

    def near(self, points: np.ndarray, reach: float) -> np.ndarray:
        """(A, B) bool: places within `reach` distances of one of `points` (K, 3)."""
        return are_near(points, self.places, reach * self.spacing).reshape(self.shape)


@dataclass(frozen=True)
class Sheet:
    """The plane of surfels, and what is known of its places.

    Attributes:
        plane: with the surfels on it.
        raster: its places (A · B, 3), over all of a box.
        centers: (M, 3) of its surfels.
        supported: (A, B) bool, places with a surface.
        within: (A, B) bool, places with room of the box before them.
        crossed: (A, B) bool, places behind which a camera saw something.
    """

    plane: Plane
    raster: Raster
    centers: np.ndarray
    supported: np.ndarray
    within: np.ndarray
    crossed: np.ndarray

    @classmethod
    def of(
        cls,
        plane: Plane,
        centers: np.ndarray,
        grid: Grid,
        space: SeenSpace,
        spacing: float,
        along: np.ndarray | None = None,
    ) -> Sheet:
        """Of a plane of surfels among those at `centers` (N, 3); its places follow `along` (3,), or else the room."""
        raster = Raster.on_plane(plane.normal.numpy(), plane.offset, grid, spacing, along)
        own = centers[plane.members.numpy()]
        # Where surfels are farther apart than elsewhere there are no holes between them.
        apart = max(spacing, float(np.median(cKDTree(own).query(own, k=NEIGHBOURS + 1)[0][:, NEIGHBOURS])))
        supported = raster.near(own, BARE * apart / spacing)
        return cls(plane, raster, own, supported, raster.within(grid), raster.crossed(space))

    @property
    def unknown(self) -> np.ndarray:
        """(A, B) bool: places that no camera saw through, and without a surface."""
        return self.within & ~self.crossed & ~self.supported


def are_near(points: np.ndarray, places: np.ndarray, reach: float) -> np.ndarray:
    """(P,) bool: the places (P, 3) within `reach` of one of `points` (K, 3)."""
    if not len(points):
        return np.zeros(len(places), dtype=bool)
    return np.isfinite(cKDTree(points).query(places, distance_upper_bound=reach)[0])
