"""Which part of a scene is room although no camera looked into it.

Of what things hide from the cameras one part is their inside and another is room, in which a light may stand. From a
point in a room one sees the fronts of surfaces, from one inside a thing the backs of its own. The share of fronts is a
winding number (Jacobson et al. 2013) of what is in sight. In the plane of a flat hole it is a half: where surfaces are
missing, as at the back of a box or the floor behind it, the room ends about where they should be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import binary_dilation
from torch import Tensor

from rgspipe.completion.free_space import Grid
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.point_sets import fibonacci_directions

#: Directions in which one looks from a point, and points whose rays are cast at once.
LOOKS, CHUNK = 64, 1024

#: Directions that one looks in at a time where more than half of them have been looked in.
AT_A_TIME = 8

#: Of so many cells along each axis one is looked at first, and the others only where those around them differ.
EVERY = 3


def with_hidden_room(grid: Grid, bvh: SurfelBvh, seen: Tensor, unsure: Tensor) -> Tensor:
    """(X, Y, Z) bool: the cells that were `seen` to be free, and those of room that is connected with them.

    Args:
        bvh: the surfaces.
        seen: (X, Y, Z) bool.
        unsure: (X, Y, Z) bool, cells that are taken for no room: those so near to surfaces that one sees past them.
    """
    centers, sparse = grid.centers.reshape(*grid.shape, 3), _Sparse.over(grid, bvh)
    free, known = seen.numpy().copy(), (seen | unsure).numpy()
    while (rim := binary_dilation(free) & ~known).any():
        places = centers[torch.from_numpy(rim)]
        all_around, nowhere_around = sparse.agreed(places)
        room, differ = all_around, ~(all_around | nowhere_around)
        if differ.any():
            room[differ] = sees_fronts(bvh, places[torch.from_numpy(differ)])
        free[rim] = room
        known |= rim
    return torch.from_numpy(free)


@dataclass(frozen=True)
class _Sparse:
    """What cells EVERY apart are, each looked at when it is first asked for: in the midst of a volume all are alike.

    Attributes:
        cells: of EVERY of a finer grid's cells along each axis, and a margin around it.
        bvh: the surfaces.
        room: (X, Y, Z) bool, whether their middles are.
        asked: (X, Y, Z) bool, where anybody asked.
    """

    cells: Grid
    bvh: SurfelBvh
    room: np.ndarray
    asked: np.ndarray

    @classmethod
    def over(cls, grid: Grid, bvh: SurfelBvh) -> _Sparse:
        cell = EVERY * grid.cell
        shape = tuple(-(-count // EVERY) + 2 for count in grid.shape)
        return cls(Grid(grid.lower - cell, cell, shape), bvh, np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool))

    def agreed(self, places: Tensor) -> tuple[np.ndarray, np.ndarray]:
        """Whether all eight middles around each of `places` (P, 3) are room, and whether none is; (P,) bool."""
        cell, lower = self.cells.cell.numpy(), self.cells.lower.numpy()
        first = np.floor((places.numpy() - lower) / cell - 0.5).astype(np.int64)
        corners = first[:, None] + np.stack(np.meshgrid(*3 * [[0, 1]], indexing="ij"), axis=-1).reshape(1, 8, 3)
        cells = np.unique(corners.reshape(-1, 3), axis=0)
        new = cells[~self.asked[tuple(cells.T)]]
        self.room[tuple(new.T)] = sees_fronts(self.bvh, torch.from_numpy(lower + (new + 0.5) * cell))
        self.asked[tuple(new.T)] = True
        room = self.room[tuple(corners.reshape(-1, 3).T)].reshape(-1, 8)
        return room.all(axis=1), ~room.any(axis=1)


def sees_fronts(bvh: SurfelBvh, points: Tensor) -> np.ndarray:
    """(P,) bool: whether from `points` (P, 3) the front of a surface is met first in more than half of all directions.

    Most points are sure long before all directions have been looked in: the others could not change the answer.
    """
    fronts, unsure, left = torch.zeros(len(points)), torch.arange(len(points)), LOOKS
    # Each of them all around.
    directions = fibonacci_directions(LOOKS).unflatten(0, (-1, AT_A_TIME)).transpose(0, 1).flatten(0, 1)
    for some in directions.tensor_split(tuple(range(LOOKS // 2 + AT_A_TIME, LOOKS, AT_A_TIME))):
        left -= len(some)
        for chunk in unsure.split(CHUNK):
            fronts[chunk] += len(some) * _parts_in_sight(bvh, points[chunk], some)[0]
        unsure = ((fronts <= LOOKS / 2) & (fronts + left > LOOKS / 2)).nonzero()[:, 0]
    return (fronts > LOOKS / 2).numpy()


def parts_in_sight(bvh: SurfelBvh, points: Tensor) -> tuple[Tensor, Tensor]:
    """Parts of all directions from each of `points` (P, 3) in which fronts and backs are met first, float32 (P,) each.

    What is left to 1 leaves the scene.
    """
    directions = fibonacci_directions(LOOKS)
    fronts, backs = zip(*(_parts_in_sight(bvh, chunk, directions) for chunk in points.split(CHUNK)), strict=True)
    return torch.cat(fronts), torch.cat(backs)


def _parts_in_sight(bvh: SurfelBvh, points: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
    rays = directions.repeat(len(points), 1)
    hits = composite(bvh, points.repeat_interleave(len(directions), dim=0), rays, two_sided=True)
    normals = bvh.surfels.normals.to(hits.weights)[hits.indices.long().clamp(min=0)]
    facing = (normals * rays.to(hits.weights)[:, None]).sum(dim=2) < 0.0
    fronts, backs = ((hits.weights * side).sum(dim=1) for side in (facing, ~facing))
    return tuple(part.reshape(len(points), len(directions)).mean(dim=1).cpu() for part in (fronts, backs))
