"""Triangles of polygons that are not convex: they cover what the polygon does, once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rgspipe.datasets.mesh.polygons import clipped, fan
from rgspipe.errors import InputError

#: A wall with a doorway, a floor like an L, an arrow, a comb, and a square with a hole that a cut joins to its outside.
SHAPES = {
    "wall": [(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (3, 0), (3, 2.5), (0, 2.5)],
    "floor": [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
    "arrow": [(2, 0), (0.3, 0.3), (0, 2), (0, 0)],
    "comb": [(0, 0), (20, 0), *((20 - 0.5 * x, 1 + 4 * (x % 2)) for x in range(41))],
    "hole": [(0, 0), (3, 0), (3, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)],
    "straight": [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2), (0, 1)],
}


def placed(flat: np.ndarray, seed: int = 0) -> np.ndarray:
    """(k, 3) in some plane, far from the origin."""
    points = np.column_stack([flat, np.zeros(len(flat))])
    return points @ Rotation.random(random_state=seed).as_matrix() + [3.0, -7.0, 2.0]


def shoelace(flat: np.ndarray) -> float:
    x, y = flat.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def triangle_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = points[triangles].transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def triangles_of(points: np.ndarray) -> np.ndarray:
    count = len(points)
    return clipped(points, [range(count)], Path("a.obj")).get(0, fan(count))


@pytest.mark.parametrize("name", SHAPES)
def test_triangles_cover_a_polygon_once_wherever_it_begins(name: str) -> None:
    flat = np.array(SHAPES[name], float)
    for first in range(len(flat)):
        for way in (1, -1):
            turned = np.roll(flat, -first, axis=0)[::way]
            areas = triangle_areas(placed(turned, first), triangles_of(placed(turned, first)))
            # Worst of all: 1.1e-15.
            assert abs(areas.sum() / shoelace(flat) - 1.0) < 1e-12


def test_triangles_of_stars_cover_them_once() -> None:
    random = np.random.default_rng(0)
    for seed in range(50):
        angles = np.sort(random.uniform(0.0, 2.0 * np.pi, random.integers(5, 40)))
        if np.diff(angles, append=angles[0] + 2.0 * np.pi).max() > 3.0:
            continue
        radii = random.uniform(0.2, 1.0, len(angles))
        flat = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        points = placed(flat, seed)
        # Worst of all: 1.1e-15.
        assert abs(triangle_areas(points, triangles_of(points)).sum() / shoelace(flat) - 1.0) < 1e-12


def test_a_doorway_stays_open() -> None:
    flat = np.array(SHAPES["wall"])
    corners = flat[triangles_of(placed(flat))]
    covered = []
    for place in [(1.5, 1.0), (1.8, 0.5), (0.5, 1.0), (1.5, 2.2)]:
        along, away = np.roll(corners, -1, 1) - corners, np.array(place) - corners
        sides = along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0]
        covered.append(int((sides > 0.0).all(axis=1).sum()))
    assert covered == [0, 0, 1, 1]


def test_fans_of_convex_and_of_bent_polygons_stay() -> None:
    """A quad of a round thing is a little bent, a corner of an edge is off by what text rounds."""
    angles = np.arange(7) * 2.0 * np.pi / 7.0
    ring = placed(np.column_stack([np.cos(angles), np.sin(angles)]))
    bent = np.array([[0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.2]])
    rounded = np.array([[0, 0, 0], [0.5, 1e-7, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    points = np.concatenate([ring, bent, rounded])
    assert clipped(points, [range(7), range(7, 11), range(11, 16)], Path("a.obj")) == {}


@pytest.mark.parametrize(
    "flat",
    [[(0, 0), (1, 1), (1, 0), (0, 1)], [(0, 0), (2, 2), (2, 0), (0, 1)], [(0, 3), (2, -3), (-3, 1), (3, 1), (-2, -3)]],
)
def test_a_polygon_that_crosses_itself_is_refused(flat: list) -> None:
    points = placed(np.array(flat, float))
    with pytest.raises(InputError, match=r"a\.obj: face 1: expected polygons that do not cross.*Triangulate the faces"):
        clipped(points, [range(3), range(len(flat))], Path("a.obj"))
