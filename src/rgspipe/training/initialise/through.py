"""Where photographs with depth looked through: places that are empty, whatever is not known of them otherwise."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rgspipe.datasets.views import View


@dataclass(frozen=True)
class LookedThrough:
    """Photographs, of which those with depth tell.

    Attributes:
        views: V of them.
    """

    views: Sequence[View]

    def __call__(self, places: np.ndarray, normals: np.ndarray, beyond: float) -> np.ndarray:
        """(M,) whether the rays of some view around a place went through the place's plane from its front.

        Args:
            places: (M, 3) scene units.
            normals: (M, 3) of their planes.
            beyond: how far behind a plane a ray has to end, scene units.
        """
        found = np.zeros(len(places), dtype=bool)
        for view in self.views:
            if view.depth is not None:
                found |= _went_on(view, places, normals, beyond)
        return found


def _went_on(view: View, places: np.ndarray, normals: np.ndarray, beyond: float) -> np.ndarray:
    """(M,) of one view.

    A pixel's ray is the one through its middle, which may go past an edge that the place is before: all four around a
    place must have gone on.
    """
    camera, depth = view.camera, view.depth.detach().cpu().double().numpy()
    pose = camera.camera_to_world.double().cpu().numpy()
    rotation, origin = pose[:3, :3], pose[:3, 3]
    local, heights = (places - origin) @ rotation, np.einsum("md,md->m", origin - places, normals)
    away = -local[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.floor(camera.cx + camera.fx * local[:, 0] / away - 0.5)
        row = np.floor(camera.cy - camera.fy * local[:, 1] / away - 0.5)
    inside = (column >= 0) & (column < camera.width - 1) & (row >= 0) & (row < camera.height - 1)
    asked = np.flatnonzero((away > 0.0) & (heights > 0.0) & inside)
    went_on = np.ones(len(asked), dtype=bool)
    for right, lower in itertools.product((0, 1), repeat=2):
        across, down = column[asked].astype(np.int64) + right, row[asked].astype(np.int64) + lower
        # Of planar depth 1, so that depths are lengths along it.
        rays = np.stack(
            [(across + 0.5 - camera.cx) / camera.fx, -(down + 0.5 - camera.cy) / camera.fy, -np.ones(len(asked))],
            axis=1,
        )
        towards = -np.einsum("md,md->m", rays @ rotation.T, normals[asked])
        # A depth that is not known tells nothing.
        went_on &= (towards > 0.0) & (depth[down, across] * towards - heights[asked] > beyond)
    found = np.zeros(len(places), dtype=bool)
    found[asked] = went_on
    return found
