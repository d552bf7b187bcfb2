"""Where photographs with depth looked through: places that are empty, whatever is not known of them otherwise."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

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
    camera, depth = view.camera, view.depth.detach().cpu().double().numpy().reshape(-1)
    pixels, away = (part.numpy() for part in camera.project(torch.from_numpy(places)))
    corner = np.floor(pixels - 0.5)
    heights = np.einsum("md,md->m", camera.origin.double().numpy() - places, normals)
    inside = (corner >= 0.0).all(axis=1) & (corner < [camera.width - 1, camera.height - 1]).all(axis=1)
    asked = np.flatnonzero((away > 0.0) & (heights > 0.0) & inside)
    column, row = corner[asked].astype(np.int64).T
    went_on = np.ones(len(asked), dtype=bool)
    for right, lower in itertools.product((0, 1), repeat=2):
        pixel = (row + lower) * camera.width + column + right
        _, directions, lengths = (part.numpy() for part in camera.rays(torch.from_numpy(pixel)))
        # Of planar depth 1, so that depths are lengths along it.
        towards = -lengths * np.einsum("md,md->m", directions, normals[asked])
        # A depth that is not known tells nothing.
        went_on &= (towards > 0.0) & (depth[pixel] * towards - heights[asked] > beyond)
    found = np.zeros(len(places), dtype=bool)
    found[asked] = went_on
    return found
