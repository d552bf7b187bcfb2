"""Surfels that are too coarse for what they stand for: photographs looked through them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from rgspipe.scene.surfels import Surfels
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.through import LookedThrough

#: Places of a surfel that are asked: rings of its reach, and directions in each.
RINGS, DIRECTIONS = (0.5, 0.75, 1.0), 12

#: Nearer to a point of the surface than this part of a spacing nothing is empty; rays are asked of the other places.
BARE = 0.125


def looked_through(
    surfels: Surfels, reach: float, cloud: Cloud, through: LookedThrough, spacing: float, beyond: float
) -> np.ndarray:
    """(N,) whether rays of some photograph went on through a surfel, within what is seen of it.

    Such a one stands for bars, leaves or a corner of more sides than it has edges: it shades what is not there, and
    made smaller it would no longer shade what is. Only smaller surfels do both.

    Args:
        reach: how far a surfel is seen, in its deviations.
        cloud: points that lie evenly on the surfaces.
        spacing: of the surfels, scene units.
        beyond: how far behind a surfel a ray has to end, scene units.
    """
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    asked = reach * (np.array(RINGS)[:, None, None] * ring).reshape(-1, 2)
    axes, centers = surfels.frames.double().numpy(), surfels.centers.double().numpy()
    in_plane = asked * surfels.scales.double().numpy()[:, None]
    clips = surfels.clip_angles.double().numpy()
    depth = in_plane @ np.stack([np.cos(clips), np.sin(clips)], axis=1)
    surfel, number = np.nonzero((depth < surfels.clip_offsets.double().numpy()[:, None]).all(axis=2))
    places = centers[surfel] + np.einsum("ma,mad->md", in_plane[surfel, number], axes[surfel, :2])
    bare = cKDTree(cloud.points).query(places, distance_upper_bound=BARE * spacing, workers=-1)[0] > BARE * spacing
    surfel, places = surfel[bare], places[bare]
    found = np.zeros(len(surfels), dtype=bool)
    found[surfel[through(places, axes[surfel, 2], beyond)]] = True
    return found
