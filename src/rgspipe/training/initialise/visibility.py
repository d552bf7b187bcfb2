"""Which facets the views confirm: what floats before a surface is seen through, what lies behind it is never seen."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rgspipe.datasets.views import View
from rgspipe.training.initialise.facets import Facets

#: Views that see a facet at a smaller cosine say little about it.
LEAST_COSINE = 0.15
#: A measured distance so many standard deviations before a facet means that it is hidden.
HIDDEN = 4.0
#: Largest median deviation of the measured distances from a true facet, in standard deviations: of itself, and by
#: chance for one view.
BIAS, CHANCE = 0.5, 3.0


def confirmed(facets: Facets, views: Sequence[View], noise: Sequence[float]) -> np.ndarray:
    """(N,) whether the depth that views measured where a facet should be agrees with it.

    Compared are the measured depth of the pixel on which a facet's centre falls and the depth at which the pixel's
    ray meets the facet's plane, in all views that face it and in which nothing stands before it; their median
    decides. A facet that no view faces is not confirmed.

    Args:
        views: those with depth.
        noise: relative standard deviation of the depth of each.
    """
    offs = np.full((len(views), len(facets)), np.nan, dtype=np.float32)
    for row, (view, deviation) in enumerate(zip(views, noise, strict=True)):
        offs[row] = _deviations(facets, view, deviation)
    compared = np.isfinite(offs)
    seen = compared & (offs > -HIDDEN)
    count = seen.sum(axis=0)
    # Sorted with the unseen last: the (lower) median of the seen.
    ordered = np.sort(np.where(seen, offs, np.inf), axis=0)
    columns = np.arange(len(facets))
    middle = ordered[np.maximum(count - 1, 0) // 2, columns]
    agrees = np.abs(middle) <= BIAS + CHANCE / np.sqrt(np.maximum(count, 1))
    return agrees & (count > 0)


def _deviations(facets: Facets, view: View, noise: float) -> np.ndarray:
    """(N,) measured minus expected depth of one view in standard deviations; NaN where it does not face a facet."""
    camera, depth = view.camera, view.depth.detach().cpu().double().numpy()
    pose = camera.camera_to_world.double().numpy()
    local = (facets.centers - pose[:3, 3]) @ pose[:3, :3]
    normals = facets.normals @ pose[:3, :3]
    away = -local[:, 2]
    before = away > 0
    scale = 1.0 / np.where(before, away, math.inf)
    column = np.floor(camera.cx + camera.fx * local[:, 0] * scale)
    row = np.floor(camera.cy - camera.fy * local[:, 1] * scale)
    inside = before & (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
    cosine = -np.einsum("nd,nd->n", local, normals) / np.maximum(np.linalg.norm(local, axis=1), 1e-300)
    compared = np.flatnonzero(inside & (cosine > LEAST_COSINE))
    column, row, normals, local = column[compared], row[compared], normals[compared], local[compared]
    ray = np.stack(
        [(column + 0.5 - camera.cx) / camera.fx, -(row + 0.5 - camera.cy) / camera.fy, -np.ones(len(compared))], axis=1
    )
    along = np.einsum("nd,nd->n", normals, ray)
    expected = np.einsum("nd,nd->n", normals, local) / np.where(along < -1e-6, along, -math.inf)
    measured = depth[row.astype(np.int64), column.astype(np.int64)]
    found = np.full(len(facets), np.nan)
    with np.errstate(invalid="ignore"):
        found[compared] = np.where(expected > 0, (measured / np.maximum(expected, 1e-300) - 1.0) / noise, np.nan)
    return found
