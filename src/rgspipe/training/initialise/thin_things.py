"""Surfaces of things that are hardly wider than a pixel: legs, leaves, rims, the facets of what is bent.

No window of a photograph fits there, so that single views say nothing of normals. The points of all views together do:
along a rod they lie on a line, on a leaf in a plane. With their scatter C and the way v back to the camera the normal
is C⁻¹ v, which is across a plane, across a line and towards the camera, and v where nothing else is known.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.training.initialise.normals import RADII
from rgspipe.training.initialise.sightings import Sightings, joined

#: Pixels within which surer sightings are compared with: the smallest window reaches so far from its pixel.
REACH = RADII[0] + 1

#: Most sightings around one that are asked: surer ones it is compared with, and others for how the thing lies. With a
#: quarter of them one pixel of a room of boxes is on no plane of its own.
NEIGHBOURS = 64

#: Pixels within which they do. With 2, 3 and 5 of them 4.13, 4.07 and 4.08 % of the pixels of views that were left out
#: are off in one furnished room (82), and 4.12, 4.35 and 4.12 % in another (81).
AROUND = 3.0

#: Sightings that are asked at once, some 300 MB: where depth is sparse none of its pixels has a window.
AT_ONCE = 65_536


def with_thin_things(sure: Sightings, rest: Sightings, pixels: np.ndarray) -> Sightings:
    """Sightings, and those of the `rest` that lie on no plane of a surer one of any view, with normals.

    Args:
        sure: with normals.
        rest: M without.
        pixels: (M,) how wide a pixel is where they are, scene units.
    """
    bare = ~_explained(sure, rest, REACH * pixels)
    return joined([sure, _with_normals(rest[bare], pixels[bare])])


def _explained(sure: Sightings, rest: Sightings, reach: np.ndarray) -> np.ndarray:
    """(M,) whether a sighting is on the plane of a surer one within `reach` (M,)."""
    explained = np.zeros(len(rest), dtype=bool)
    if not len(sure):
        return explained
    points, surer, tree = rest.points, sure.points, cKDTree(sure.points)
    for part in _parts(len(rest)):
        near, distance = _nearest(tree, points[part])
        off = np.einsum("mkd,mkd->mk", points[part, None] - surer[near], sure.normals[near])
        on_plane = (np.abs(off) <= rest.deviations[part, None]) & (distance <= reach[part, None])
        explained[part] = on_plane.any(axis=1)
    return explained


def _with_normals(sightings: Sightings, pixels: np.ndarray) -> Sightings:
    """The same, with the normals that their neighbours tell."""
    if not len(sightings):
        return sightings
    points, normals = sightings.points, np.zeros((len(sightings), 3))
    tree = cKDTree(points)
    for part in _parts(len(sightings)):
        near, distance = _nearest(tree, points[part])
        weight = (distance <= AROUND * pixels[part, None]).astype(np.float64)
        weight /= weight.sum(axis=1, keepdims=True)
        away = points[near] - np.einsum("mk,mkd->md", weight, points[near])[:, None]
        # A point is as uncertain as its pixel is wide.
        own = (pixels[part] ** 2 / 12.0)[:, None, None] * np.eye(3)
        scatter = np.einsum("mk,mki,mkj->mij", weight, away, away) + own
        normals[part] = np.linalg.solve(scatter, -sightings.directions[part, :, None])[..., 0]
    return sightings.moved(sightings.distances, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _parts(count: int) -> Iterator[slice]:
    """All of so many, few enough at a time for memory."""
    return (slice(start, start + AT_ONCE) for start in range(0, count, AT_ONCE))


def _nearest(tree: cKDTree, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points (M, K) of a tree that are nearest to places (M, 3), NEIGHBOURS at most, and how far they are."""
    count = min(NEIGHBOURS, tree.n)
    distance, near = tree.query(places, k=count, workers=-1)
    return near.reshape(len(places), count), distance.reshape(len(places), count)
