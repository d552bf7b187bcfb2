"""One oriented point cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Cloud:
    """M surface points in numpy float64.

    Attributes:
        points: (M, 3) scene units.
        normals: (M, 3) unit vectors towards the side from which the points were seen.
    """

    points: np.ndarray
    normals: np.ndarray

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, index: np.ndarray | slice) -> Cloud:
        return Cloud(self.points[index], self.normals[index])
