"""Which facet a ray meets where two surfaces do."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.training.initialise.facets import SAME_SURFACE, Facets
from rgspipe.training.initialise.sightings import Sightings

#: How far around a facet others are looked for, and how far from its centre its plane is trusted, in facet sizes.
REACH, TRUSTED = 2.5, 1.5
#: Facets looked at around each, and other surfaces told apart among them.
NEIGHBOURS, OTHERS = 32, 3
#: A sighting that is farther from its surface, in standard deviations, is of something else.
OUTLIER = 4.5
#: Smallest cosine at which a ray is said to meet a plane.
LEAST_COSINE = 0.05


def meet(sightings: Sightings, facets: Facets, label: np.ndarray, size: float) -> np.ndarray:
    """The facet (M,) that each sighting's ray meets, −1 where none explains it, from a first guess `label` (M,).

    Near a crease noise does not tell on which of the two surfaces a pixel lies, but geometry does: behind a
    convex edge a ray enters at the farther of the two planes, in a concave one it stops at the nearer.

    Args:
        label: facet that each sighting was taken to lie on, −1 for none.
        size: of a facet, scene units.
    """
    strong = np.flatnonzero(facets.strong)
    tree = cKDTree(facets.centers[strong])
    adrift = (label < 0) | ~facets.strong[label]
    label = label.copy()
    label[adrift] = _nearest(sightings[adrift], sightings.points[adrift], facets, strong, tree, size)
    others = _other_surfaces(facets, strong, tree, size)
    for _ in range(2):
        label = _decide(sightings, facets, label, others, strong, tree, size)
    distance = distance_to(sightings, facets, label)
    explains = np.abs(distance - sightings.measured) <= OUTLIER * sightings.deviations
    hit = sightings.origins + sightings.directions * np.where(np.isfinite(distance), distance, 0.0)[:, None]
    explains &= np.linalg.norm(hit - facets.centers[label], axis=1) <= TRUSTED * size
    return np.where(explains, label, -1)


def distance_to(sightings: Sightings, facets: Facets, label: np.ndarray) -> np.ndarray:
    """(M,) along each ray to the plane of its facet; infinite without a facet or where the plane is grazed."""
    normals = facets.normals[label]
    cosine = np.einsum("md,md->m", normals, sightings.directions)
    offset = np.einsum("md,md->m", normals, facets.centers[label] - sightings.origins)
    met = (label >= 0) & (cosine < -LEAST_COSINE)
    return np.where(met, offset / np.where(met, cosine, 1.0), np.inf)


def _nearest(
    sightings: Sightings, points: np.ndarray, facets: Facets, strong: np.ndarray, tree: cKDTree, size: float
) -> np.ndarray:
    """The facet (M,) nearest to `points`, of those whose planes the rays meet near their centres; −1 without one."""
    count = min(NEIGHBOURS // 2, len(strong))
    distance, index = tree.query(points, k=count, distance_upper_bound=REACH * size, workers=-1)
    distance, index = distance.reshape(len(points), count), index.reshape(len(points), count)
    best, nearest = np.full(len(points), -1), np.full(len(points), np.inf)
    for column in range(count):
        found = np.isfinite(distance[:, column])
        candidate = np.where(found, strong[np.where(found, index[:, column], 0)], -1)
        along = distance_to(sightings, facets, candidate)
        hit = sightings.origins + sightings.directions * np.where(np.isfinite(along), along, 0.0)[:, None]
        away = np.linalg.norm(hit - facets.centers[candidate], axis=1)
        fits = np.abs(along - sightings.measured) <= OUTLIER * sightings.deviations
        fits &= _agrees(sightings, facets, candidate) & (away < np.minimum(nearest, REACH * size))
        best, nearest = np.where(fits, candidate, best), np.where(fits, away, nearest)
    return best


def _other_surfaces(facets: Facets, strong: np.ndarray, tree: cKDTree, size: float) -> np.ndarray:
    """(N, OTHERS) for each facet the nearest facets of surfaces that are turned from it and from one another, or −1."""
    count = min(NEIGHBOURS, len(strong))
    distance, index = tree.query(facets.centers, k=count, distance_upper_bound=REACH * size, workers=-1)
    distance, index = distance.reshape(len(facets), count), index.reshape(len(facets), count)
    candidates = np.where(np.isfinite(distance), strong[np.where(np.isfinite(distance), index, 0)], -1)
    others = np.full((len(facets), OTHERS), -1)
    free = candidates >= 0
    free &= ~_alike(facets, candidates, np.arange(len(facets)))
    for place in range(OTHERS):
        first = free.argmax(axis=1)
        chosen = np.where(free.any(axis=1), candidates[np.arange(len(facets)), first], -1)
        others[:, place] = chosen
        free &= ~_alike(facets, candidates, chosen)
    return others


def _alike(facets: Facets, candidates: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(N, K) whether candidates face the way of the chosen facet (N,)."""
    return (facets.normals[candidates] @ facets.normals[chosen][..., None])[..., 0] > SAME_SURFACE


def _decide(
    sightings: Sightings,
    facets: Facets,
    label: np.ndarray,
    others: np.ndarray,
    strong: np.ndarray,
    tree: cKDTree,
    size: float,
) -> np.ndarray:
    """Labels (M,) after each ray was asked whether it really meets another surface near its facet."""
    chosen = label.copy()
    for place in range(OTHERS):
        asked = np.flatnonzero((label >= 0) & (others[label, place] >= 0))
        if not len(asked):
            continue
        part, mine = sightings[asked], label[asked]
        other = others[mine, place]
        here, there = distance_to(part, facets, mine), distance_to(part, facets, other)
        between = facets.centers[other] - facets.centers[mine]
        rise = np.einsum("md,md->m", facets.normals[mine], between)
        back = -np.einsum("md,md->m", facets.normals[other], between)
        convex, concave = (rise < 0) & (back < 0), (rise > 0) & (back > 0)
        over = (convex & (there > here)) | (concave & (there < here))
        over &= np.isfinite(there) & _agrees(part, facets, other)
        moved, part = asked[over], part[over]
        hit = part.origins + part.directions * there[over][:, None]
        landed = _nearest_alike(hit, facets.normals[other[over]], facets, strong, tree, size)
        chosen[moved] = np.where(landed >= 0, landed, chosen[moved])
    return chosen


def _nearest_alike(
    points: np.ndarray, normals: np.ndarray, facets: Facets, strong: np.ndarray, tree: cKDTree, size: float
) -> np.ndarray:
    """The nearest facet (M,) to each point that faces the way of `normals`; −1 if none is near."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    count = min(NEIGHBOURS // 2, len(strong))
    distance, index = tree.query(points, k=count, distance_upper_bound=REACH * size, workers=-1)
    distance, index = distance.reshape(len(points), count), index.reshape(len(points), count)
    found = np.isfinite(distance)
    candidates = strong[np.where(found, index, 0)]
    found &= (facets.normals[candidates] @ normals[..., None])[..., 0] > SAME_SURFACE
    first = found.argmax(axis=1)
    return np.where(found.any(axis=1), candidates[np.arange(len(points)), first], -1)


def _agrees(sightings: Sightings, facets: Facets, label: np.ndarray) -> np.ndarray:
    """Whether a facet may be what a sighting with a normal pass saw; True for sightings without one."""
    cosine = np.einsum("md,md->m", facets.normals[label], sightings.normals)
    return ~sightings.given | (cosine > SAME_SURFACE)
