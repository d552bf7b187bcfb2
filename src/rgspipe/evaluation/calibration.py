"""The regions that fits state, as they are drawn and put into tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.fitting.certainty.regions import CONFIDENCE, quantile


def position_sd(covariances: Sequence[ArrayLike], scene_size: float) -> float:
    """Root-mean-square position error that the worst light of a rig is said to have, a fraction of the scene's size.

    inf where a position is not determined; NaN without lights.
    """
    if not covariances or not scene_size > 0.0:
        return math.nan
    worst = max(float(to_array(matrix).diagonal()[:3].sum()) for matrix in covariances)
    return math.sqrt(worst) / scene_size


def ellipse(covariance: ArrayLike, confidence: float = CONFIDENCE) -> tuple[float, float, float] | None:
    """The outline of a region as it is seen along an axis: full axes' lengths and the angle of the first [degrees].

    The region is that of all three coordinates: its outline, not the narrower region of the two that are seen.

    Args:
        covariance: (2, 2) of the two coordinates that are seen.

    Returns:
        None where a variance is infinite.
    """
    matrix = to_array(covariance)
    if not np.isfinite(matrix).all():
        return None
    values, vectors = np.linalg.eigh(matrix)
    first, second = (2.0 * np.sqrt(np.clip(values[::-1], 0.0, None) * quantile(confidence, 3))).tolist()
    return first, second, math.degrees(math.atan2(float(vectors[1, 1]), float(vectors[0, 1])))


def half_axes(covariance: ArrayLike, longest: float, confidence: float = CONFIDENCE) -> tuple[npt.NDArray, npt.NDArray]:
    """Lengths (3,) of the half-axes of a region, and their directions, the columns of (3, 3).

    Args:
        covariance: (3, 3) of a position; variances that are not finite have half-axes of `longest`.
        longest: what lengths are cut off at.
    """
    matrix = np.array(to_array(covariance), dtype=float)
    unknown = ~np.isfinite(matrix.diagonal())
    matrix[unknown] = matrix[:, unknown] = 0.0
    matrix[unknown, unknown] = longest**2
    values, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.minimum(np.sqrt(np.maximum(values, 0.0) * quantile(confidence, 3)), longest), axes
