"""Surfel centres and normals refined against the points around them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.training.initialise.cloud import Cloud


def refit_planes(
    centers: Cloud, cloud: Cloud, spacing: float, *, neighbours: int = 64, radius: float = 1.6, least_points: int = 8
) -> Cloud:
    """`centers` moved along their normals onto planes fitted to the points of `cloud` around them.

    Points count that lie within `radius` spacings and whose normals are within 41° of the centre's; a second
    fit leaves out, softly, what is off the first plane by more than a quarter of a spacing. Where fewer than
    `least_points` count, or the plane would turn the normal by more than 32°, the centre stays as it is.
    """
    neighbours = min(neighbours, len(cloud))
    distance, index = cKDTree(cloud.points).query(
        centers.points, k=neighbours, distance_upper_bound=radius * spacing, workers=-1
    )
    distance, index = distance.reshape(len(centers), -1), index.reshape(len(centers), -1)
    near = np.isfinite(distance)
    index = np.where(near, index, 0)
    points = cloud.points[index] - centers.points[:, None]
    alike = np.einsum("nkd,nd->nk", cloud.normals[index], centers.normals) > 0.75
    weights = (near & alike).astype(np.float64)
    enough = weights.sum(axis=1) >= least_points

    normals = centers.normals
    offset = np.zeros_like(normals)
    for refined in (False, True):
        if refined:
            off = np.einsum("nkd,nd->nk", points - offset[:, None], normals) / (0.25 * spacing)
            weights = weights * np.exp(-0.5 * off * off)
        mean, fitted = _planes(points, weights, normals)
        agrees = enough & (np.einsum("nd,nd->n", fitted, centers.normals) > 0.85)
        normals = np.where(agrees[:, None], fitted, normals)
        offset = np.where(enough[:, None], mean, offset)
    along = np.einsum("nd,nd->n", offset, normals)
    return Cloud(centers.points + normals * along[:, None], normals)


def _planes(points: np.ndarray, weights: np.ndarray, towards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted means (N, 3) and unit normals (N, 3), on the side of `towards`, of the points (N, K, 3)."""
    total = np.maximum(weights.sum(axis=1), 1e-300)
    mean = np.einsum("nk,nkd->nd", weights, points) / total[:, None]
    around = points - mean[:, None]
    scatter = np.einsum("nk,nki,nkj->nij", weights, around, around) / total[:, None, None]
    normals = np.linalg.eigh(scatter)[1][:, :, 0]
    side = np.where(np.einsum("nd,nd->n", normals, towards) < 0, -1.0, 1.0)
    return mean, normals * side[:, None]
