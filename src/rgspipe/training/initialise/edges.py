"""Straight edges of surfels: where the surface they lie on ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.scene.surfels import NO_CLIP
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.resample import thin

DIRECTIONS = 72
#: Between two of them edges are looked for in so many steps to either side.
FINER = 8
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
    """

    reach: float = 1.5
    plane_tolerance: float = 0.3
    least_offset: float = 0.15
    trim: int = 2
    least_angle: float = 0.9
    least_points: int = 24


def find_edges(
    centers: Cloud,
    axes: np.ndarray,
    cloud: Cloud,
    thinned: Cloud,
    spacing: np.ndarray,
    seen: tuple[float, float],
    options: EdgeOptions | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Up to two half-plane clips a surfel, from the support function of the coplanar points around it.

    In the plane of a surfel, the support s(φ) = max x·(cos φ, sin φ) of the points around it is about the reach
    inside a surface, and the distance of the edge in the direction of an edge. The clip stands at the smallest s.

    Args:
        centers: N surfels.
        axes: (N, 3, 3) rows u, v, normal; angles are measured from u towards v.
        cloud: the points, all of them; the more, the truer the edges.
        thinned: about one of them in a quarter of a spacing, to tell quickly which surfels are near an edge.
        spacing: (N,) of each surfel to its neighbours, scene units.
        seen: how far a surfel is seen that is whole, and one that is clipped, in spacings: an edge that is nearer
            clips it.

    Returns:
        offsets (N, 2), scene units, NO_CLIP where there is no edge, and angles (N, 2) [rad].
    """
    options, median = options or EdgeOptions(), float(np.median(spacing))
    offsets, angles = np.full((len(centers), 2), NO_CLIP), np.zeros((len(centers), 2))
    radius = options.reach * seen[1] * spacing
    coarse = _Around(centers, axes, thin(thinned, median / 4.0), radius, replace(options, least_points=0), median)
    # Coarse points stand inside of the true edge, so that the test by these is the wider one.
    near = np.flatnonzero(coarse.support(_compass(len(centers))).min(axis=1) < seen[0] * spacing)
    if not len(near):
        return offsets, angles
    fine = thin(cloud, 0.08 * median, average=False)
    fine = fine[_within(fine.points, centers.points[near], float(radius.max()))]
    around = _Around(centers[near], axes[near], fine, radius[near], options, median)
    offsets[near], angles[near] = _clips(around, spacing[near], seen, options)
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

    def support(self, angles: np.ndarray) -> np.ndarray:
        """(N, D) support of the coplanar points in the directions `angles` (N, D), +inf where there are too few."""
        tree, support = cKDTree(self.cloud.points), np.full(angles.shape, np.inf)
        for start in range(0, len(self.centers), CHUNK):
            block = slice(start, start + CHUNK)
            lists = tree.query_ball_point(
                self.centers.points[block], self.radius[block], workers=-1, return_sorted=True
            )
            for surfel, found in enumerate(lists, start):
                support[surfel] = self._support_of(surfel, np.asarray(found, dtype=np.int64), angles[surfel])
        return support

    def _support_of(self, surfel: int, near: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """(D,) of one of them, by the points `near`."""
        inside = self.cloud.points[near] - self.centers.points[surfel]
        first, second, normal = self.axes[surfel]
        keep = np.abs(inside @ normal) < self.options.plane_tolerance * self.spacing
        keep &= self.cloud.normals[near] @ normal > 0.7
        if keep.sum() <= max(self.options.least_points - 1, self.options.trim):
            return np.full(len(angles), np.inf)
        flat = inside[keep] @ np.stack([first, second], axis=1)
        reach = flat @ np.stack([np.cos(angles), np.sin(angles)])
        last = len(reach) - 1 - self.options.trim
        return np.partition(reach, last, axis=0)[last]


def _clips(
    around: _Around, spacing: np.ndarray, seen: tuple[float, float], options: EdgeOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (N, 2) and angles (N, 2) of the two nearest edges, the second well apart from the first."""
    compass = _compass(len(spacing))
    support, rows = around.support(compass), np.arange(len(spacing))
    # The support of a polygon has its local minima at the edges; at a corner the lowest values stand side by side.
    dip = (support <= np.roll(support, 1, axis=1)) & (support <= np.roll(support, -1, axis=1))
    edges = np.where(dip, support, np.inf)
    first = edges.argmin(axis=1)
    turn = np.abs((compass - compass[rows, first][:, None] + np.pi) % (2.0 * np.pi) - np.pi)
    others = np.where(turn > options.least_angle, edges, np.inf)
    nearest = np.stack([first, others.argmin(axis=1)], axis=1)
    distance = np.stack([edges[rows, first], others[rows, nearest[:, 1]]], axis=1)
    clipped = (distance[:, :1] < seen[0] * spacing[:, None]) & (distance < seen[1] * spacing[:, None])
    distance, angles = _between(around, compass[rows[:, None], nearest])
    placed = np.maximum(distance, options.least_offset * spacing[:, None])
    return np.where(clipped, placed, NO_CLIP), np.where(clipped, angles, 0.0)


def _between(around: _Around, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Supports (N, 2) and angles (N, 2) of the edges near `angles`, which lie between two directions of the compass.

    Turned by δ, a line that all points of an edge of length 2l lie within stands l sin δ too far out.
    """
    turns = np.pi / DIRECTIONS * np.linspace(-1.0, 1.0, 2 * FINER + 1)
    tried = angles[:, :, None] + turns
    support = around.support(tried.reshape(len(angles), -1)).reshape(tried.shape)
    best = support.argmin(axis=2)[..., None]
    return np.take_along_axis(support, best, axis=2)[..., 0], np.take_along_axis(tried, best, axis=2)[..., 0]


def _within(points: np.ndarray, centers: np.ndarray, radius: float) -> np.ndarray:
    """Indices of the points that have a centre within `radius`."""
    distance, _ = cKDTree(centers).query(points, distance_upper_bound=radius, workers=-1)
    return np.flatnonzero(np.isfinite(distance))


def _compass(count: int) -> np.ndarray:
    """(count, DIRECTIONS) angles all around."""
    return np.broadcast_to(np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False), (count, DIRECTIONS))
