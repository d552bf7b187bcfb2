"""Views of a torus in empty space with its true depth, by sphere tracing."""

from __future__ import annotations

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.scene import Camera, look_at

#: Radii of the circle in the middle of the tube and of the tube.
RING, TUBE = 0.3, 0.12


def torus_distance(points: np.ndarray) -> np.ndarray:
    """(M,) signed distance to the torus around the z axis."""
    across = np.hypot(points[:, 0], points[:, 1]) - RING
    return np.hypot(across, points[:, 2]) - TUBE


def torus_normals(points: np.ndarray) -> np.ndarray:
    """(M, 3) outward normals at points near the surface."""
    around = np.hypot(points[:, 0], points[:, 1])[:, None]
    middle = np.concatenate([points[:, :2] * (RING / around), np.zeros((len(points), 1))], axis=1)
    return (points - middle) / np.linalg.norm(points - middle, axis=1, keepdims=True)


def torus_views(count: int, resolution: int = 64, seed: int = 0) -> list[View]:
    """Black images with true depth from random places on a sphere of radius 1; +inf beside the torus."""
    rng = np.random.default_rng(seed)
    views = []
    for index in range(count):
        eye = rng.standard_normal(3)
        matrix = look_at(torch.from_numpy(eye / np.linalg.norm(eye)), torch.zeros(3))
        camera = Camera.from_field_of_view(matrix, 1.0, resolution, resolution)
        origins, directions, lengths = (part.numpy() for part in camera.rays())
        distance = np.zeros(len(origins))
        for _ in range(80):
            distance += np.minimum(torus_distance(origins + directions * distance[:, None]), 1.0)
        met = np.abs(torus_distance(origins + directions * distance[:, None])) < 1e-5
        depth = torch.from_numpy(np.where(met, distance / lengths, np.inf)).float().reshape(resolution, resolution)
        views.append(
            View(
                name=f"train/r_{index:04d}",
                camera=camera,
                image=torch.zeros(resolution, resolution, 3),
                alpha=torch.isfinite(depth).float(),
                depth=depth,
            )
        )
    return views
