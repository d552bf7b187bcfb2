"""Straight edges of surfels: where the surface they lie on ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.scene.surfels import NO_CLIP
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.resample import thin

#: Tells of places (M, 3) in planes of normals (M, 3) whether rays that went past them end so far behind the plane.
Through = Callable[[np.ndarray, np.ndarray, float], np.ndarray]

DIRECTIONS = 72
#: Between two of them edges are looked for in so many steps to either side.
FINER = 8
#: Strips are followed in one of so many of them: at the end of a surfel they are as wide as that.
COARSER = 3
#: Surfels whose edges are looked for at once; bounds the memory.
CHUNK = 256


@dataclass(frozen=True)
class EdgeOptions:
    """How edges are told from chance; lengths in spacings.

    Attributes:
        reach: radius of the neighbourhood whose coplanar points are looked at, in what is seen of a surfel.
        plane_tolerance: points farther from the surfel's plane belong to another surface.
        least_offset: an edge is never put nearer to the centre, as the surfel would vanish.
        trim: outermost points that are left out in each direction, against strays.
        least_angle: between a surfel's two edges [rad]; nearer ones are the same edge.
        least_points: with fewer coplanar points around it a surfel stays whole.
        strip: half-width of the strips along which the surface is followed from a surfel's centre.
    """

    reach: float = 1.5
    plane_tolerance: float = 0.3
    least_offset: float = 0.15
    trim: int = 2
    least_angle: float = 0.9
    least_points: int = 24
    strip: float = 0.25


def find_edges(
    centers: Cloud,
    axes: np.ndarray,
    cloud: Cloud,
    thinned: Cloud,
    spacing: np.ndarray,
    seen: tuple[float, float],
    through: Through | None = None,
    options: EdgeOptions | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Up to two half-plane clips a surfel, from the support function of the coplanar points around it.

    In the plane of a surfel, the support s(φ) = max x·(cos φ, sin φ) of the points around it is about the reach
    inside a surface, and the distance of the edge in the direction of an edge. The clip stands at the smallest s.

    Beside a notch, such as the corner of an opening in a wall, the surface goes on past both edges, and s tells
    nothing. There strips are followed from the centre, and the clip stands before the nearest place that one finds
    empty. What it takes away of the surface is covered by neighbours that look along one of the edges.

    Args:
        centers: N surfels.
        axes: (N, 3, 3) rows u, v, normal; angles are measured from u towards v.
        cloud: the points, all of them; the more, the truer the edges.
        thinned: about one of them in a quarter of a spacing, to tell quickly which surfels are near an edge.
        spacing: (N,) of each surfel to its neighbours, scene units.
        seen: how far a surfel is seen that is whole, and one that is clipped, in spacings: an edge that is nearer
            clips it.
        through: tells empty places; without it surfels at notches hang over.

    Returns:
        offsets (N, 2), scene units, NO_CLIP where there is no edge, and angles (N, 2) [rad].
    """
    options, median = options or EdgeOptions(), float(np.median(spacing))
    offsets, angles = np.full((len(centers), 2), NO_CLIP), np.zeros((len(centers), 2))
    radius = options.reach * seen[1] * spacing
    coarse = _Around(centers, axes, thin(thinned, median / 4.0), radius, replace(options, least_points=0), median)
    # Coarse points stand inside of the true edge, so that the test by these is the wider one.
    compass = _compass(len(centers))
    nearest = coarse.support(compass).min(axis=1)
    if through is not None:
        nearest = np.minimum(nearest, coarse.along_strips(compass[:, ::COARSER]).min(axis=1))
    near = np.flatnonzero(nearest < seen[0] * spacing)
    if not len(near):
        return offsets, angles
    fine = thin(cloud, 0.08 * median, average=False)
    fine = fine[_within(fine.points, centers.points[near], float(radius.max()))]
    around = _Around(centers[near], axes[near], fine, radius[near], options, median)
    empty = np.full((len(near), DIRECTIONS), np.inf) if through is None else around.empty(through)
    offsets[near], angles[near] = _clips(around, spacing[near], seen, empty)
    return offsets, angles


@dataclass(frozen=True)
class _Around:
    """N surfels, and the points around them.

    Attributes:
        centers, axes: of the surfels, as of `find_edges`.
        cloud: the points.
        radius: (N,) within which they count, scene units.
        spacing: the typical one.
    """

    centers: Cloud
    axes: np.ndarray
    cloud: Cloud
    radius: np.ndarray
    options: EdgeOptions
    spacing: float

    def __getitem__(self, index: np.ndarray) -> _Around:
        return replace(self, centers=self.centers[index], axes=self.axes[index], radius=self.radius[index])

    def support(self, angles: np.ndarray) -> np.ndarray:
        """(N, D) support of the coplanar points in the directions `angles` (N, D), +inf where there are too few."""
        support = np.full(angles.shape, np.inf)
        for surfel, flat in self._coplanar():
            support[surfel] = _outermost(flat @ _directions(angles[surfel]), self.options.trim)
        return support

    def along_strips(self, angles: np.ndarray) -> np.ndarray:
        """(N, D) where the surface ends by the coplanar points that are in a strip in each direction, as `support`.

        The last of n points that lie evenly as far as an edge is, on average, 1 / (n + 1) of the way before it.
        """
        width, support = self.options.strip * self.spacing, np.full(angles.shape, np.inf)
        for surfel, flat in self._coplanar():
            reach = flat @ _directions(angles[surfel])
            inside = (reach > 0.0) & (np.abs(flat @ _directions(angles[surfel] + 0.5 * np.pi)) < width)
            last = np.where(inside, reach, 0.0).max(axis=0)
            support[surfel] = last * (1.0 + 1.0 / np.maximum(inside.sum(axis=0), 1))
        return support

    def empty(self, through: Through) -> np.ndarray:
        """(N, DIRECTIONS) how far off strips end where rays went through what follows; inf where none did."""
        compass, empty = _compass(len(self.centers))[:, ::COARSER], np.full((len(self.centers), DIRECTIONS), np.inf)
        stand = self.along_strips(compass)
        surfel, number = np.nonzero(stand < self.radius[:, None])
        stand = stand[surfel, number]
        first, second, normal = self.axes[surfel].transpose(1, 0, 2)
        across, up = (stand + self.options.strip * self.spacing) * _directions(compass[surfel, number])
        places = self.centers.points[surfel] + across[:, None] * first + up[:, None] * second
        seen = through(places, normal, self.options.plane_tolerance * self.spacing)
        empty[surfel[seen], number[seen] * COARSER] = stand[seen]
        return empty

    def _coplanar(self) -> Iterator[tuple[int, np.ndarray]]:
        """Each of the surfels that has enough of them around it, and the points (P, 2) in its plane."""
        tree, least = cKDTree(self.cloud.points), max(self.options.least_points, self.options.trim + 1)
        for start in range(0, len(self.centers), CHUNK):
            block = slice(start, start + CHUNK)
            lists = tree.query_ball_point(
                self.centers.points[block], self.radius[block], workers=-1, return_sorted=True
            )
            for surfel, found in enumerate(lists, start):
                near = np.asarray(found, dtype=np.int64)
                inside = self.cloud.points[near] - self.centers.points[surfel]
                first, second, normal = self.axes[surfel]
                keep = np.abs(inside @ normal) < self.options.plane_tolerance * self.spacing
                keep &= self.cloud.normals[near] @ normal > 0.7
                if keep.sum() >= least:
                    yield surfel, inside[keep] @ np.stack([first, second], axis=1)


def _directions(angles: np.ndarray) -> np.ndarray:
    """(2, D) unit vectors."""
    return np.stack([np.cos(angles), np.sin(angles)])


def _outermost(reach: np.ndarray, trim: int) -> np.ndarray:
    """(D,) largest of (P, D) but for the `trim` largest."""
    last = len(reach) - 1 - trim
    return np.partition(reach, last, axis=0)[last]


def _clips(
    around: _Around, spacing: np.ndarray, seen: tuple[float, float], empty: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (N, 2) and angles (N, 2) of the two nearest edges, the second well apart from the first.

    Args:
        empty: (N, DIRECTIONS) as of `_Around.empty`; an edge is one of these places if no other edge takes it away.
    """
    options, compass, rows = around.options, _compass(len(spacing)), np.arange(len(spacing))
    support = around.support(compass)
    # The support of a polygon has its local minima at the edges; at a corner the lowest values stand side by side.
    dip = (support <= np.roll(support, 1, axis=1)) & (support <= np.roll(support, -1, axis=1))
    edges = np.where(dip, support, np.inf)
    slack = options.strip * around.spacing
    for number in _two_nearest(edges, edges, compass, options).T:
        empty = _left_by(edges[rows, number], compass[rows, number], empty, compass, slack)
    either = np.minimum(edges, empty)
    first = either.argmin(axis=1)
    left = np.minimum(edges, _left_by(either[rows, first], compass[rows, first], empty, compass, slack))
    at = (rows[:, None], _two_nearest(either, left, compass, options))
    distance, notch = either[at], empty[at] < edges[at]
    clipped = (distance[:, :1] < seen[0] * spacing[:, None]) & (distance < seen[1] * spacing[:, None])
    found = np.stack(_between(around.support, compass[at], 1))
    strips = np.flatnonzero((notch & clipped).any(axis=1))
    beside = np.stack(_between(around[strips].along_strips, compass[at][strips], COARSER))
    found[:, strips] = np.where(notch[strips], beside, found[:, strips])
    distance, angles = found
    placed = np.maximum(distance, options.least_offset * spacing[:, None])
    return np.where(clipped, placed, NO_CLIP), np.where(clipped, angles, 0.0)


def _two_nearest(one: np.ndarray, other: np.ndarray, compass: np.ndarray, options: EdgeOptions) -> np.ndarray:
    """(N, 2) int directions of the least distance in `one` (N, D), and of the least in `other` well apart from it."""
    rows, first = np.arange(len(one)), one.argmin(axis=1)
    turn = np.abs((compass - compass[rows, first][:, None] + np.pi) % (2.0 * np.pi) - np.pi)
    second = np.where(turn > options.least_angle, other, np.inf).argmin(axis=1)
    return np.stack([first, second], axis=1)


def _left_by(offset: np.ndarray, angle: np.ndarray, empty: np.ndarray, compass: np.ndarray, slack: float) -> np.ndarray:
    """(N, D) of the `empty` places those that a clip (N,) does not take away, by more than `slack`; else inf."""
    return np.where(empty * np.cos(compass - angle[:, None]) > offset[:, None] - slack, np.inf, empty)


def _between(
    support: Callable[[np.ndarray], np.ndarray], angles: np.ndarray, step: int
) -> tuple[np.ndarray, np.ndarray]:
    """Supports (N, 2) and angles (N, 2) of the edges near `angles`, one of every `step` directions.

    Turned by δ, a line that all points of an edge of length 2l lie within stands l sin δ too far out.
    """
    turns = step * np.pi / DIRECTIONS * np.linspace(-1.0, 1.0, 2 * FINER + 1)
    tried = angles[:, :, None] + turns
    supports = support(tried.reshape(len(angles), angles.shape[1] * len(turns))).reshape(tried.shape)
    best = supports.argmin(axis=2)[..., None]
    return np.take_along_axis(supports, best, axis=2)[..., 0], np.take_along_axis(tried, best, axis=2)[..., 0]


def _within(points: np.ndarray, centers: np.ndarray, radius: float) -> np.ndarray:
    """Indices of the points that have a centre within `radius`."""
    distance, _ = cKDTree(centers).query(points, distance_upper_bound=radius, workers=-1)
    return np.flatnonzero(np.isfinite(distance))


def _compass(count: int) -> np.ndarray:
    """(count, DIRECTIONS) angles all around."""
    return np.broadcast_to(np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False), (count, DIRECTIONS))
