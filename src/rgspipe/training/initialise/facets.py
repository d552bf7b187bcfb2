"""Small planar pieces of a surface, each fitted to what many views measured around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.training.initialise.resample import sums
from rgspipe.training.initialise.sightings import Sightings

#: Normals of one surface, within a radius, differ by less than this cosine.
SAME_SURFACE = 0.85
#: Half the width of the interval that a wider fit must share with all narrower ones, in standard deviations.
CONFIDENCE = 2.5
#: Residual, in standard deviations, at which a neighbour counts a quarter.
OUTLIER = 4.0
#: Fewest neighbours of a fit.
LEAST_NEIGHBOURS = 6
#: Most facets in the widest neighbourhood; their size is a sixth of its radius, so that 113 cover it.
MOST_NEIGHBOURS = 150
#: A facet with a smaller share of the mean weight of itself and the nearest ones, or with fewer sightings, is weak.
WEAK, NEAREST, LEAST_SIGHTINGS = 0.2, 48, 3
#: Facets fitted at once; bounds the memory.
CHUNK = 2048


@dataclass(frozen=True)
class Facets:
    """N planar pieces of the surface.

    Attributes:
        centers: (N, 3) scene units.
        normals: (N, 3) unit vectors towards the cameras.
        weights: (N,) inverse variance of the measured offset of the facet's own sightings, 1/unit².
        bends: (N, 3, 3) second derivatives of the height over the plane, 1/unit; 0 where a plane will do.
        strong: (N,) whether a facet has its share of the sightings around it; others are mixtures and strays.
    """

    centers: np.ndarray
    normals: np.ndarray
    weights: np.ndarray
    bends: np.ndarray
    strong: np.ndarray

    def __len__(self) -> int:
        return len(self.centers)


def fit_facets(sightings: Sightings, label: np.ndarray, radii: np.ndarray) -> Facets:
    """Planes through the sightings that share a label, each fitted to its whole neighbourhood.

    The ray of a sighting is exact and only the distance along it is noisy. So the offset that a plane explains is
    that of the measured points, but the places in the plane at which it explains them are those where the rays meet
    the present surface; noise in those would flatten the planes. The neighbourhood grows through `radii` as long as
    the wider fit agrees with all narrower ones within their confidence intervals (Goldenshluger and Nemirovski 1997):
    where it stops early, as the surface bends, a paraboloid is fitted to the next radius instead.

    Args:
        sightings: M of them, with their present distances and normals.
        label: (M,) facet of each sighting, −1 for none; from 0 without gaps.
        radii: (R,) ascending, scene units; the widest must span some facets.
    """
    used = label >= 0
    sightings, label = sightings[used], label[used]
    count = int(label.max()) + 1
    weight = sightings.certainty()
    total = np.maximum(np.bincount(label, weight, count), 1e-300)

    def mean(values: np.ndarray) -> np.ndarray:
        return sums(values * weight[:, None], label, count) / total[:, None]

    places, measured, normals = mean(sightings.points), mean(sightings.measured_points), mean(sightings.normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    neighbours = min(count, MOST_NEIGHBOURS)
    distance, index = cKDTree(places).query(places, k=neighbours, distance_upper_bound=radii[-1], workers=-1)
    distance, index = distance.reshape(count, -1), index.reshape(count, -1)
    index = np.where(np.isfinite(distance), index, 0)
    fitted, offset, supported = normals.copy(), np.zeros(count), np.zeros(count, dtype=bool)
    bends = np.zeros((count, 3, 3))
    for start in range(0, count, CHUNK):
        part = slice(start, start + CHUNK)
        fitted[part], offset[part], bends[part], supported[part] = _fit_chunk(
            places, measured, normals, total, part, distance[part], index[part], radii
        )
    # Mixtures of two surfaces and strays hold few sightings. The mean is by weight, as strays lie among strays, and
    # over like normals, as few views may see one surface and many the next.
    alike = (distance[:, :NEAREST] < radii[1]) & (_dot(normals[index[:, :NEAREST]], normals) > SAME_SURFACE)
    near = np.where(alike, total[index[:, :NEAREST]], 0.0)
    around = (near**2).sum(axis=1) / np.maximum(near.sum(axis=1), 1e-300)
    sightings_each = np.bincount(label, minlength=count)
    strong = supported & (total >= WEAK * around) & (sightings_each >= LEAST_SIGHTINGS)
    return Facets(places + normals * offset[:, None], fitted, total, bends, strong)


def _fit_chunk(
    places: np.ndarray,
    measured: np.ndarray,
    normals: np.ndarray,
    weights: np.ndarray,
    part: slice,
    distance: np.ndarray,
    index: np.ndarray,
    radii: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Normals (C, 3), offsets (C,) along the old normals, bends (C, 3, 3), whether there was a fit, for `part`."""
    here, normal = places[part], normals[part]
    along, across = tangents(normal)
    away = places[index] - here[:, None]
    height = _dot(away, normal)
    alike = (_dot(normals[index], normal) > SAME_SURFACE) & (np.abs(height) < 0.35 * distance + 0.45 * radii[0])
    u, v = _dot(away, along), _dot(away, across)
    # Offset and slopes explain the measured offsets: the last column is what the first three are to give.
    system = np.stack([np.ones_like(u), u, v, _dot(measured[index] - here[:, None], normal)], axis=-1)
    nearby = np.where(alike & np.isfinite(distance), weights[index], 0.0)
    best, steps, supported = _widest_plane(system, nearby, distance, radii)
    forms = np.zeros((len(here), 3))
    bent = np.flatnonzero(supported & (steps < len(radii) - 1))
    if len(bent):
        curves = np.stack([0.5 * u[bent] ** 2, u[bent] * v[bent], 0.5 * v[bent] ** 2], axis=-1)
        radius = radii[steps[bent] + 1]
        bowl = np.concatenate([system[bent][..., :3], curves, system[bent][..., 3:]], axis=-1)
        weight = nearby[bent] * np.maximum(1.0 - (distance[bent] / radius[:, None]) ** 2, 0.0)
        found, _ = _robust(bowl, nearby[bent], weight, radius)
        best[bent], forms[bent] = found[:, :3], found[:, 3:]
    tilted = normal - best[:, 1:2] * along - best[:, 2:] * across
    frame = np.stack([along, across], axis=1)
    form = forms[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    bends = np.swapaxes(frame, 1, 2) @ form @ frame
    return tilted / np.linalg.norm(tilted, axis=1, keepdims=True), best[:, 0], bends, supported


def _widest_plane(
    system: np.ndarray, nearby: np.ndarray, distance: np.ndarray, radii: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offset and slopes (C, 3) of the widest fit that agrees with all narrower ones, its radius (C,), if any (C,)."""
    count = len(system)
    best, steps = np.zeros((count, 3)), np.zeros(count, dtype=np.int64)
    low, high = np.full((count, 3), -np.inf), np.full((count, 3), np.inf)
    growing, supported = np.ones(count, dtype=bool), np.zeros(count, dtype=bool)
    for step, radius in enumerate(radii):
        weight = nearby * np.maximum(1.0 - (distance / radius) ** 2, 0.0)
        found, variance = _robust(system, nearby, weight, np.full(count, radius))
        enough = (weight > 0).sum(axis=1) >= LEAST_NEIGHBOURS
        margin = CONFIDENCE * np.sqrt(variance)
        new_low, new_high = np.maximum(low, found - margin), np.minimum(high, found + margin)
        taken = growing & enough & (new_low <= new_high).all(axis=1)
        best[taken], low[taken], high[taken], steps[taken] = found[taken], new_low[taken], new_high[taken], step
        supported |= taken
        growing &= taken | ~enough
    return best, steps, supported


def _robust(
    system: np.ndarray, nearby: np.ndarray, weight: np.ndarray, radius: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`_solve`, twice: what is far off the first solution counts little in the second."""
    found, _ = _solve(system, weight, radius)
    off = np.sqrt(nearby) * (system[..., -1] - _dot(system[..., :-1], found))
    return _solve(system, weight / (1.0 + (off / OUTLIER) ** 2) ** 2, radius)


def _solve(system: np.ndarray, weight: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted least squares (C, P) and variances (C, P), slopes and bends held a little where nothing fixes them."""
    moments = np.swapaxes(system * weight[..., None], 1, 2) @ system
    total, unknowns = moments[:, 0, 0] + 1e-300, system.shape[2] - 1
    order = np.array([0, 1, 1, 2, 2, 2])[:unknowns]
    held = np.array([1e-9, 1e-4, 1e-5])[order] * radius[:, None] ** (2 * order) * total[:, None]
    inverse = np.linalg.inv(moments[:, :-1, :-1] + held[:, :, None] * np.eye(unknowns))
    return (inverse @ moments[:, :-1, -1:])[..., 0], np.diagonal(inverse, axis1=1, axis2=2)


def tangents(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (N, 3) across each of the normals, and across one another."""
    helper = np.where(np.abs(normals[:, :1]) < 0.6, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    along = np.cross(normals, helper)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return along, np.cross(normals, along)


def _dot(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N, K) products of (N, K, D) with (N, D)."""
    return (vectors @ normals[..., None])[..., 0]
