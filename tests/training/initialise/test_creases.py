"""On which of two surfaces a ray ends, where noise cannot tell: geometry does."""

from __future__ import annotations

import numpy as np
import pytest

from rgspipe.training.initialise.creases import distance_to, meet
from rgspipe.training.initialise.facets import Facets
from rgspipe.training.initialise.sightings import Sightings

SIZE = 0.05


def sheet(corner: np.ndarray, along: np.ndarray, across: np.ndarray, normal: np.ndarray) -> Facets:
    """10 × 10 facets of SIZE from `corner` on."""
    step = (np.arange(10) + 0.5) * SIZE
    u, v = (grid.reshape(-1, 1) for grid in np.meshgrid(step, step))
    count = len(u)
    return Facets(
        corner + u * along + v * across,
        np.repeat(normal[None], count, axis=0),
        np.ones(count),
        np.zeros((count, 3, 3)),
        np.ones(count, dtype=bool),
    )


def together(*parts: Facets) -> Facets:
    return Facets(**{name: np.concatenate([vars(part)[name] for part in parts]) for name in vars(parts[0])})


X, Y, Z = np.eye(3)
#: The floor x > 0 and the wall x = 0 that rises from it, and the step x > 0 whose front x = 0 falls from it.
VALLEY = together(sheet(np.zeros(3), X, Y, Z), sheet(np.zeros(3), Y, Z, X))
STEP = together(sheet(np.zeros(3), X, Y, Z), sheet(np.zeros(3), Y, -Z, -X))


def looking(side: float, noise: float, seed: int = 0) -> tuple[Sightings, np.ndarray]:
    """Rays onto the two surfaces within a facet of the crease from `side` of it, and which of them are on the wall."""
    rng = np.random.default_rng(seed)
    count = 2000
    wall = rng.random(count) < 0.5
    away, place = rng.uniform(0.0, 0.8 * SIZE, count), rng.uniform(0.1, 0.4, count)
    rise = 1.0 if side > 0 else -1.0
    points = np.where(wall[:, None], [0, 1, 0] * place[:, None] + [0, 0, rise] * away[:, None], 0.0)
    points = np.where(wall[:, None], points, [1, 0, 0] * away[:, None] + [0, 1, 0] * place[:, None])
    origins = points * 0.0 + rng.uniform([side * 0.5 - 0.1, 0.2, 0.5], [side * 0.5 + 0.1, 0.3, 0.7], (count, 3))
    distance = np.linalg.norm(points - origins, axis=1)
    measured = distance * (1.0 + noise * rng.standard_normal(count))
    normals = np.where(rng.random(count)[:, None] < 0.5, Z, X * side)
    directions = (points - origins) / distance[:, None]
    given = np.zeros(count, dtype=bool)
    return Sightings(origins, directions, measured, noise * distance, measured, normals, given), wall


@pytest.mark.parametrize("facets, side", [(VALLEY, 1.0), (STEP, -1.0)], ids=["concave", "convex"])
@pytest.mark.parametrize("noise", [0.005, 0.02])
def test_rays_end_on_the_right_side_of_a_crease(facets: Facets, side: float, noise: float) -> None:
    seen, wall = looking(side, noise)
    guess = np.random.default_rng(1).integers(0, 2, len(seen)) * 100  # floor or wall by the toss of a coin
    nearest = np.linalg.norm(seen.points[:, None] - facets.centers[None, :], axis=2)
    floor = np.where(np.arange(len(facets)) < 100, nearest, np.inf).argmin(axis=1)
    front = np.where(np.arange(len(facets)) < 100, np.inf, nearest).argmin(axis=1)
    label = meet(seen, facets, np.where(guess > 0, front, floor), SIZE)
    assert (label >= 0).mean() > 0.97  # measured 1
    right = (label >= 100) == wall
    assert right[label >= 0].mean() > 0.995  # measured 1; by the nearest facet alone 0.98 at the larger noise


def test_a_ray_that_no_facet_explains_gets_none() -> None:
    seen, _ = looking(1.0, 0.001)
    far = Sightings(**{**vars(seen), "measured": seen.measured * 0.5, "distances": seen.distances * 0.5})
    assert (meet(far, VALLEY, np.zeros(len(far), dtype=np.int64), SIZE) == -1).all()


def test_planes_are_met_where_rays_cross_them_from_the_front() -> None:
    seen, _ = looking(1.0, 0.0001)
    floor = distance_to(seen, VALLEY, np.zeros(len(seen), dtype=np.int64))
    assert np.abs((seen.origins + seen.directions * floor[:, None])[:, 2]).max() < 1e-12
    behind = Sightings(**{**vars(seen), "directions": -seen.directions})
    assert np.isinf(distance_to(behind, VALLEY, np.zeros(len(seen), dtype=np.int64))).all()
    assert np.isinf(distance_to(seen, VALLEY, np.full(len(seen), -1))).all()
