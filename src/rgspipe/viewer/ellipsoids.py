"""The region in which a lamp is with 95 % probability, as a mesh."""

from __future__ import annotations

import math

import numpy as np
from torch import Tensor

from rgspipe.evaluation.calibration import half_axes

#: Smallest half-axis that is drawn, so that a region is seen at all, and largest, of the scene's size.
LEAST, MOST = 0.004, 2.0

_ROUND, _HIGH = 24, 12


def region(position: Tensor, covariance: Tensor, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3) of the ellipsoid of a lamp.

    Args:
        position: (3,) of the lamp.
        covariance: (D, D), the position first; what has no finite variance is drawn as long as MOST.
        size: of the scene.
    """
    lengths, directions = half_axes(covariance[:3, :3], MOST * size)
    points, faces = _ball()
    return position.numpy() + (points * np.maximum(lengths, LEAST * size)) @ directions.T, faces


def _ball() -> tuple[np.ndarray, np.ndarray]:
    around = np.linspace(0.0, 2.0 * math.pi, _ROUND, endpoint=False)
    down = np.linspace(0.0, math.pi, _HIGH)
    phi, theta = np.meshgrid(around, down)
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    row, column = np.meshgrid(np.arange(_HIGH - 1), np.arange(_ROUND), indexing="ij")
    a, b = row * _ROUND + column, row * _ROUND + (column + 1) % _ROUND
    lower = np.stack([a, a + _ROUND, b], axis=-1), np.stack([b, a + _ROUND, b + _ROUND], axis=-1)
    return points.reshape(-1, 3), np.concatenate([part.reshape(-1, 3) for part in lower])
