"""Straight edges of surfels: where the surface they lie on ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.scene.surfels import NO_CLIP
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.resample import thin

DIRECTIONS = 72
#: Neighbours of a coarse cloud by which the surfels near an edge are told from the others.
COARSE_NEIGHBOURS = 96
#: Surfels whose edges are looked for at once; bounds the memory.
CHUNK = 256


@dataclass(frozen=True)
class EdgeOptions:
    """How edges are told from chance; lengths in spacings.

    Attributes:
        reach: radius of the neighbourhood whose coplanar points are looked at.
        threshold: an edge nearer than this clips the surfel.
        margin: how far beyond the outermost points the surface is taken to go on.
        plane_tolerance: points farther from the surfel's plane belong to another surface.
        least_offset: an edge is never put nearer to the centre, as the surfel would vanish.
        trim: outermost points that are left out in each direction, against strays.
        least_angle: between a surfel's two edges [rad]; nearer ones are the same edge.
        least_points: with fewer coplanar points around it a surfel stays whole.
    """

    reach: float = 1.4
    threshold: float = 0.8
    margin: float = 0.02
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
    spacing: float,
    options: EdgeOptions | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Up to two half-plane clips a surfel, from the support function of the coplanar points around it.

    In the plane of a surfel, the support s(φ) = max x·(cos φ, sin φ) of the points around it is about the reach
    inside a surface, and the distance of the edge in the direction of an edge. The clip stands at the smallest s.

    Args:
        centers: N surfels.
        axes: (N, 3, 3) rows u, v, normal; angles are measured from u towards v.
        cloud: the points, all of them; the more, the truer the edges.
        thinned: about one of them in a quarter of `spacing`, to tell quickly which surfels are near an edge.
        spacing: between surfels, scene units.

    Returns:
        offsets (N, 2), scene units, NO_CLIP where there is no edge, and angles (N, 2) [rad].
    """
    options = options or EdgeOptions()
    offsets = np.full((len(centers), 2), NO_CLIP)
    angles = np.zeros((len(centers), 2))
    near = _near_edges(centers, axes, thinned, spacing, options)
    if not len(near):
        return offsets, angles
    fine = thin(cloud, 0.08 * spacing, average=False)
    fine = fine[_within(fine.points, centers.points[near], options.reach * spacing)]
    tree = cKDTree(fine.points)
    for start in range(0, len(near), CHUNK):
        chosen = near[start : start + CHUNK]
        support = _support(centers[chosen], axes[chosen], fine, tree, spacing, options)
        offsets[chosen], angles[chosen] = _clips(support, spacing, options)
    return offsets, angles


def _near_edges(centers: Cloud, axes: np.ndarray, cloud: Cloud, spacing: float, options: EdgeOptions) -> np.ndarray:
    """Indices of the surfels that may have an edge, by their nearest points in a coarse cloud."""
    coarse = thin(cloud, spacing / 4.0)
    count = min(COARSE_NEIGHBOURS, len(coarse))
    distance, index = cKDTree(coarse.points).query(
        centers.points, k=count, distance_upper_bound=options.reach * spacing, workers=-1
    )
    distance, index = distance.reshape(len(centers), count), index.reshape(len(centers), count)
    found = np.isfinite(distance)
    index = np.where(found, index, 0)
    inside = coarse.points[index] - centers.points[:, None]
    coplanar = found & _coplanar(inside, coarse.normals[index], axes, spacing, options)
    flat = np.einsum("nkd,ncd->nkc", inside, axes[:, :2])
    support = np.full((len(centers), DIRECTIONS), -np.inf)
    for direction, compass in enumerate(_compass()):
        support[:, direction] = np.where(coplanar, flat @ compass, -np.inf).max(axis=1)
    # The coarse points stand up to a cell inside the true edge, so the test is wider by that.
    return np.flatnonzero(support.min(axis=1) < (options.threshold + 0.05) * spacing)


def _support(
    centers: Cloud, axes: np.ndarray, cloud: Cloud, tree: cKDTree, spacing: float, options: EdgeOptions
) -> np.ndarray:
    """(N, DIRECTIONS) support of the coplanar points around each surfel, +inf where there are too few."""
    lists = tree.query_ball_point(centers.points, options.reach * spacing, workers=-1, return_sorted=True)
    owner = np.repeat(np.arange(len(centers)), [len(found) for found in lists])
    index = np.concatenate([np.asarray(found, dtype=np.int64) for found in lists])
    inside = cloud.points[index] - centers.points[owner]
    keep = _coplanar(inside[:, None], cloud.normals[index][:, None], axes[owner], spacing, options)[:, 0]
    owner, inside = owner[keep], inside[keep]
    flat = np.einsum("md,mcd->mc", inside, axes[owner, :2])
    reach = flat @ _compass().T

    support = np.full((len(centers), DIRECTIONS), np.inf)
    size = np.bincount(owner, minlength=len(centers))
    start = np.concatenate([[0], np.cumsum(size)])
    for surfel in np.flatnonzero(size >= max(options.least_points, options.trim + 1)):
        part = reach[start[surfel] : start[surfel + 1]]
        kth = len(part) - 1 - options.trim
        support[surfel] = np.partition(part, kth, axis=0)[kth]
    return support


def _clips(support: np.ndarray, spacing: float, options: EdgeOptions) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (N, 2) and angles (N, 2) of the two nearest edges, the second well apart from the first."""
    compass = np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False)
    rows = np.arange(len(support))
    # The support of a polygon has its local minima at the edges; at a corner the lowest values stand side by side.
    dip = (support <= np.roll(support, 1, axis=1)) & (support <= np.roll(support, -1, axis=1))
    edges = np.where(dip, support, np.inf)
    first = edges.argmin(axis=1)
    turn = np.abs((compass - compass[first][:, None] + np.pi) % (2.0 * np.pi) - np.pi)
    others = np.where(turn > options.least_angle, edges, np.inf)
    # Without a first edge there is no second one, as the first is the nearest.
    nearest = np.stack([first, others.argmin(axis=1)], axis=1)
    distance = np.stack([edges[rows, first], others[rows, nearest[:, 1]]], axis=1)
    clipped = distance < options.threshold * spacing
    placed = np.maximum(distance, options.least_offset * spacing) + options.margin * spacing
    return np.where(clipped, placed, NO_CLIP), np.where(clipped, compass[nearest], 0.0)


def _coplanar(
    inside: np.ndarray, normals: np.ndarray, axes: np.ndarray, spacing: float, options: EdgeOptions
) -> np.ndarray:
    """(N, K) whether points (N, K, 3), relative to their surfel, lie in its plane and face its way."""
    off = np.abs(np.einsum("nkd,nd->nk", inside, axes[:, 2]))
    return (off < options.plane_tolerance * spacing) & (np.einsum("nkd,nd->nk", normals, axes[:, 2]) > 0.7)


def _within(points: np.ndarray, centers: np.ndarray, radius: float) -> np.ndarray:
    """Indices of the points that have a centre within `radius`."""
    distance, _ = cKDTree(centers).query(points, distance_upper_bound=radius, workers=-1)
    return np.flatnonzero(np.isfinite(distance))


def _compass() -> np.ndarray:
    """(DIRECTIONS, 2) unit vectors all around."""
    angle = np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)
