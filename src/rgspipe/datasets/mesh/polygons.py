"""Triangles of polygons: of those for which a fan around the first corner, as decoders take it, is another surface."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rgspipe.errors import InputError
from rgspipe.scene.mesh import Indices, Numbers

#: Part of a polygon's extent squared that its fan may cover outside of it: coordinates are rounded in text.
SLIVER = 1e-6

#: Part of the extent squared below which twice an area is none, and two directions do not differ.
NO_AREA = 1e-12


def fan(count: int) -> Indices:
    """(count − 2, 3) corners of triangles around the first one."""
    later = np.arange(1, count - 1)
    return np.stack([np.zeros_like(later), later, later + 1], axis=1)


def clipped(points: Numbers, polygons: Sequence[Sequence[int] | Indices], path: Path) -> dict[int, Indices]:
    """The triangles (T, 3), as numbers of corners, of those polygons whose fan covers what they do not.

    Args:
        points: (V, 3).
        polygons: the points of each one.
        path: for errors.

    Raises:
        InputError: one of them crosses itself; it is counted from 0.
    """
    sizes: dict[int, list[int]] = defaultdict(list)
    for number, polygon in enumerate(polygons):
        if len(polygon) > 3:
            sizes[len(polygon)].append(number)
    found = {}
    for numbers in sizes.values():
        corners = points[np.array([polygons[number] for number in numbers])]
        for index in np.flatnonzero(_fans_are_wrong(corners)):
            flat = _flat(corners[index])
            triangles = None if flat is None or _crosses_itself(flat) else _ears(flat)
            if triangles is None:
                expected, remedy = "polygons that do not cross themselves", "Triangulate the faces when you export it."
                where, what = f"{path}: face {numbers[index]}", f"one of {len(corners[index])} corners that does"
                raise InputError(where, expected=expected, found=what, remedy=remedy)
            found[numbers[index]] = triangles
    return found


@np.errstate(all="ignore")  # of points that are refused later
def _fans_are_wrong(corners: Numbers) -> np.ndarray:
    """(M,) of polygons (M, k, 3); those that are a little bent, as quads of round things, are not."""
    arms = corners - corners[:, :1]
    crosses = np.cross(arms[:, 1:-1], arms[:, 2:])
    total = crosses.sum(axis=1)
    length, size = np.linalg.norm(total, axis=1), np.linalg.norm(crosses, axis=2).sum(axis=1)
    along = np.einsum("mkd,md->mk", crosses, total) / length[:, None]
    outside = np.where(length > SLIVER * size, -along.min(axis=1), size)
    return outside > SLIVER * (arms**2).sum(axis=2).max(axis=1)


def _flat(corners: Numbers) -> Numbers | None:
    """(k, 2) anticlockwise in the plane of a polygon (Newell), up to 1 from the first corner; None without a plane."""
    arms = corners - corners[0]
    arms = arms / np.linalg.norm(arms, axis=1).max()
    normal = np.cross(arms[1:-1], arms[2:]).sum(axis=0)
    if (length := np.linalg.norm(normal)) <= NO_AREA:
        return None
    normal /= length
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    return arms @ np.stack([across, np.cross(normal, across)], axis=1)


def _turn(a: Numbers, b: Numbers, c: Numbers) -> Numbers:
    """Twice the area of triangles (..., 2), positive anticlockwise."""
    (x, y), (u, v) = np.moveaxis(b - a, -1, 0), np.moveaxis(c - a, -1, 0)
    return x * v - y * u


def _crosses_itself(flat: Numbers) -> bool:
    """Whether two edges cross within both; edges may touch, as where a hole is joined to the outside."""
    ends = np.roll(flat, -1, axis=0)
    for number, (a, b) in enumerate(zip(flat, ends, strict=True)):
        c, d = flat[number + 1 :], ends[number + 1 :]
        sides = np.stack([_turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)])
        apart = np.abs(sides).min(axis=0) > NO_AREA
        if (apart & (sides[0] * sides[1] < 0.0) & (sides[2] * sides[3] < 0.0)).any():
            return True
    return False


def _ears(flat: Numbers) -> Indices | None:
    """Triangles of an anticlockwise polygon, cut off one by one where no other corner is inside; None if none can be.

    Corners on a straight line go first: they cover nothing.
    """
    ring, triangles = np.arange(len(flat)), []
    while len(ring) > 2:
        before, here, after = flat[np.roll(ring, 1)], flat[ring], flat[np.roll(ring, -1)]
        turns = _turn(before, here, after)
        straight = np.flatnonzero(np.abs(turns) <= NO_AREA)
        place = straight[0] if len(straight) else _ear(np.stack([before, here, after]), turns)
        if place is None:
            return None
        if not len(straight):
            triangles.append([ring[place - 1], ring[place], ring[(place + 1) % len(ring)]])
        ring = np.delete(ring, place)
    return np.array(triangles, np.int64).reshape(-1, 3)


def _ear(corners: Numbers, turns: Numbers) -> int | None:
    """The first corner that can be cut off a ring (3, k, 2: before, here and after); one that others touch at last."""
    for least in (-NO_AREA, NO_AREA):
        for place in np.flatnonzero(turns > NO_AREA):
            a, b, c = corners[:, place]
            inside = np.minimum(_turn(a, b, corners[1]), _turn(b, c, corners[1]))
            inside = np.minimum(inside, _turn(c, a, corners[1])) > least
            apart = [np.abs(corners[1] - corner).max(axis=1) > NO_AREA for corner in (a, b, c)]
            if not (inside & np.logical_and.reduce(apart)).any():
                return int(place)
    return None
