"""Things of revolution of which a side was seen.

Drums, vases and lamps are surfaces of revolution, most about an axis that is one of the room's. All normals of one lie
in planes through its axis, so that a few surfels tell where this is; and what was seen at a height tells the radius
there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from rgspipe.completion.rasters import Continued

#: Surfels from which an axis is tried at once, and so many others near each, up to so many distances away.
TRIED, PARTNERS, FAR = 128, 4, 8.0

#: Angle [rad] by which normals may leave the planes through the axis, and by which those of two surfels that tell an
#: axis must differ at least.
ASKEW, APART = math.radians(10.0), math.radians(20.0)

#: Sectors around an axis, and how many of them in a row must have surfels: of a box, whose sides have normals through
#: its middle, too, no more than three have.
SECTORS, ROUND = 24, 5

#: Fewest surfels in each of these sectors, and fewest of a thing: less is no shape.
FEWEST_IN_SECTOR, FEWEST = 3, 32

#: Sectors in which a thing must have been seen at a height for its radius there to be believed.
TOLD = 3

#: Surfels whose normals are nearer to the vertical than this tell no axis (cosine).
LEVEL = 0.9

#: Surfels of one thing are no farther apart than so many distances; radii at a height differ by no more than so many.
TOGETHER, OFF = 2.0, 1.0


@dataclass(frozen=True)
class Revolved:
    """A surface of revolution about a vertical axis.

    Attributes:
        axis: (2,) x and y of the axis.
        members: (M,) int64 indices of its surfels.
        heights, radii: (Z,) of its profile, one distance of neighbours apart along z.
        slopes: (Z, 2) unit normals of the profile, outwards and up.
    """

    axis: np.ndarray
    members: np.ndarray
    heights: np.ndarray
    radii: np.ndarray
    slopes: np.ndarray

    def all_around(self, spacing: float) -> Continued:
        """Places on all of it, a distance of neighbours apart along rings."""
        parts = []
        for height, radius, (out, up) in zip(self.heights, self.radii, self.slopes, strict=True):
            turns = np.linspace(0.0, 2.0 * np.pi, max(3, round(2.0 * np.pi * radius / spacing)), endpoint=False)
            ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
            level = np.ones((len(ring), 1))
            places = np.hstack([self.axis + radius * ring, height * level])
            parts.append(Continued(places, np.hstack([out * ring, up * level])))
        return Continued.joined(parts)


def things_of_revolution(centers: np.ndarray, normals: np.ndarray, spacing: float) -> list[Revolved]:
    """Those about z among surfels at `centers` (N, 3), the one with most first; no surfel is of two."""
    rest, found = np.flatnonzero(np.abs(normals[:, 2]) < LEVEL), []
    while len(rest) >= FEWEST:
        thing = _best(centers, normals, rest, spacing)
        if thing is None:
            break
        found.append(thing)
        rest = np.setdiff1d(rest, thing.members)
    return found


def _best(centers: np.ndarray, normals: np.ndarray, rest: np.ndarray, spacing: float) -> Revolved | None:
    """The thing with most surfels among `rest`; None where there is none."""
    places, ways = centers[rest], normals[rest]
    tried = [(_score(places, ways, axis, reach), axis, reach) for axis, reach in _axes(places, ways, spacing)]
    for score, axis, reach in sorted(tried, key=lambda one: -one[0]):
        if score < FEWEST:
            return None
        thing = _fitted(centers, normals, rest, axis, reach, spacing)
        if thing is not None:
            return thing
    return None


def _axes(places: np.ndarray, normals: np.ndarray, spacing: float) -> list[tuple[np.ndarray, float]]:
    """Axes (2,) in which normals of two surfels that are near each other meet, behind both; and their distance."""
    tree, found = cKDTree(places), []
    for index in np.linspace(0, len(places) - 1, min(TRIED, len(places))).round().astype(int):
        near = np.array(tree.query_ball_point(places[index], FAR * spacing))
        flat = normals[near, :2] / np.linalg.norm(normals[near, :2], axis=1, keepdims=True)
        own = normals[index, :2] / np.linalg.norm(normals[index, :2])
        across = own[0] * flat[:, 1] - own[1] * flat[:, 0]
        chosen = np.flatnonzero(np.abs(across) > math.sin(APART))
        for other in chosen[np.linspace(0, len(chosen) - 1, min(PARTNERS, len(chosen))).round().astype(int)]:
            # places[index] − a · own = places[near[other]] − b · flat[other]
            lines = np.stack([-own, flat[other]], axis=1)
            a, b = np.linalg.solve(lines, places[near[other], :2] - places[index, :2])
            if min(a, b) > spacing:
                found.append((places[index, :2] - a * own, float(max(a, b))))
    return found


def _score(places: np.ndarray, normals: np.ndarray, axis: np.ndarray, reach: float) -> int:
    """How many surfels around an axis may be of one thing, in sectors that lie side by side."""
    on, sector = _around(places, normals, axis, 1.5 * reach)
    counts = np.bincount(sector[on], minlength=SECTORS)
    run = _longest_run(counts >= FEWEST_IN_SECTOR)
    return int(counts[run].sum()) if len(run) >= ROUND else 0


def _around(places: np.ndarray, normals: np.ndarray, axis: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """(P,) bool, whether normals lie in planes through the axis and lead away from it; and (P,) int64 sectors."""
    outward = places[:, :2] - axis
    radius = np.linalg.norm(outward, axis=1).clip(min=1e-12)
    along = (normals[:, :2] * outward).sum(axis=1) / radius
    across = (normals[:, 1] * outward[:, 0] - normals[:, 0] * outward[:, 1]) / radius
    on = (radius < reach) & (along > 0.0) & (np.abs(across) < math.sin(ASKEW) * np.hypot(along, across))
    sector = np.floor((np.arctan2(outward[:, 1], outward[:, 0]) / (2.0 * np.pi) % 1.0) * SECTORS).astype(int) % SECTORS
    return on, sector


def _longest_run(values: np.ndarray) -> np.ndarray:
    """Indices of the most values in a row that are true, around the end, too."""
    if values.all():
        return np.arange(len(values))
    first = int((~values).argmax())
    best: list[int] = []
    run: list[int] = []
    for index in (np.arange(len(values)) + first) % len(values):
        run = [*run, int(index)] if values[index] else []
        best = max(best, run, key=len)
    return np.array(best, dtype=int)


def _fitted(
    centers: np.ndarray, normals: np.ndarray, rest: np.ndarray, axis: np.ndarray, reach: float, spacing: float
) -> Revolved | None:
    """The thing around about this axis, of surfels that hang together; None where they are not round after all."""
    members = rest
    for _ in range(3):
        on, _ = _around(centers[rest], normals[rest], axis, 1.5 * reach)
        members = _largest_part(centers, rest[on], spacing)
        if len(members) < FEWEST:
            return None
        # Every normal's line passes through the axis: a least-squares problem in its place.
        flat = normals[members, :2] / np.linalg.norm(normals[members, :2], axis=1, keepdims=True)
        across = np.stack([-flat[:, 1], flat[:, 0]], axis=1)
        axis = np.linalg.lstsq(across, (across * centers[members, :2]).sum(axis=1), rcond=None)[0]
    thing = _profiled(centers, normals, members, axis, spacing)
    return thing if _score(centers[thing.members], normals[thing.members], axis, np.inf) >= FEWEST else None


def _largest_part(centers: np.ndarray, members: np.ndarray, spacing: float) -> np.ndarray:
    """The members of the largest part that hangs together."""
    if not len(members):
        return members
    pairs = cKDTree(centers[members]).query_pairs(TOGETHER * spacing, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=2 * (len(members),))
    labels = connected_components(graph, directed=False)[1]
    return members[labels == np.bincount(labels).argmax()]


def _profiled(
    centers: np.ndarray, normals: np.ndarray, members: np.ndarray, axis: np.ndarray, spacing: float
) -> Revolved:
    """The thing of the members that are as far from the axis as others at their height."""
    radius = np.linalg.norm(centers[members, :2] - axis, axis=1)
    height = centers[members, 2]
    levels = np.arange(height.min(), height.max() + 0.5 * spacing, spacing)
    level = np.floor((height - height.min()) / spacing + 0.5).astype(int).clip(max=len(levels) - 1)
    known = np.unique(level)
    radii = np.interp(np.arange(len(levels)), known, [np.median(radius[level == one]) for one in known])
    kept = np.abs(radius - radii[level]) < OFF * spacing
    # What touches a thing stands on one side of it.
    _, sector = _around(centers[members], normals[members], axis, np.inf)
    sectors = np.array([len(np.unique(sector[kept & (level == one)])) for one in range(len(levels))])
    told = np.flatnonzero(sectors >= TOLD)
    first, last = (told[0], told[-1] + 1) if len(told) else (0, 0)
    slope = np.gradient(radii, levels) if len(levels) > 1 else np.zeros(len(levels))
    slopes = np.stack([np.ones(len(levels)), -slope], axis=1)
    slopes /= np.linalg.norm(slopes, axis=1, keepdims=True)
    return Revolved(axis, members[kept], levels[first:last], radii[first:last], slopes[first:last])
