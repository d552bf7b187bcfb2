"""Cameras, square and without distortion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Pixels along an image's side.
PIXELS = 128


@dataclass(frozen=True)
class Shot:
    """A camera: its place, what it looks at, and its horizontal field of view [degrees]."""

    eye: np.ndarray
    aim: np.ndarray
    degrees: float

    @property
    def focal(self) -> float:
        return 0.5 * PIXELS / math.tan(0.5 * math.radians(self.degrees))

    @property
    def pose(self) -> np.ndarray:
        """(4, 4) camera-to-world, OpenGL axes."""
        back = (self.eye - self.aim) / np.linalg.norm(self.eye - self.aim)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(back, right), back, self.eye], axis=1)
        return pose

    def rays(self, within: np.ndarray | float = 0.5) -> np.ndarray:
        """(P, 3) unit directions through the pixels, row by row: through their middles, or (P, 2) places `within`."""
        column, row = np.meshgrid(np.arange(PIXELS), np.arange(PIXELS))
        places = np.stack([column, row], axis=-1).reshape(-1, 2) + within
        u, v = ((places - 0.5 * PIXELS) / self.focal).T
        rays = np.stack([u, -v, -np.ones_like(u)], axis=-1) @ self.pose[:3, :3].T
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def frames(self, place: np.ndarray) -> bool:
        """Whether a place is within the picture, hidden or not."""
        x, y, z = self.pose[:3, :3].T @ (place - self.eye)
        return z < 0.0 and max(abs(x), abs(y)) < 0.5 * PIXELS / self.focal * -z

    def frame(self, path: str) -> dict[str, Any]:
        middle = 0.5 * PIXELS
        intrinsics = [middle, middle, self.focal, self.focal]
        return {"file_path": path, "transform_matrix": self.pose.tolist(), "camera_intrinsics": intrinsics}
