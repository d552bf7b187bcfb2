"""Whether the regions that fits state hold the truth as often as they should."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.special import gammaincinv

from rgspipe.evaluation.arrays import ArrayLike, to_array

#: The share of the cases in which a region should hold the truth.
CONFIDENCE = 0.95


def squared_distance(estimate: ArrayLike, truth: ArrayLike, covariance: ArrayLike) -> tuple[float, int]:
    """(e − t)ᵀ C⁻¹ (e − t), Mahalanobis' squared distance, and over how many coordinates.

    Coordinates with an infinite variance say nothing and are left out.

    Args:
        estimate, truth: (d,).
        covariance: (d, d) symmetric, without NaN; infinite variances have covariances of zero.

    Returns:
        The squared distance, inf where the covariance allows no deviation along the one that there is; and d less the
        infinite variances.
    """
    matrix = to_array(covariance)
    known = np.isfinite(matrix.diagonal())
    deviation = (to_array(estimate) - to_array(truth))[known]
    if not np.isfinite(deviation).all():
        return math.inf, int(known.sum())
    values, vectors = np.linalg.eigh(matrix[np.ix_(known, known)])
    along = vectors.T @ deviation
    if np.any((values <= 0.0) & (along != 0.0)):
        return math.inf, int(known.sum())
    return float(np.sum(along[values > 0.0] ** 2 / values[values > 0.0])), int(known.sum())


def inside(
    estimates: Sequence[ArrayLike],
    truths: Sequence[ArrayLike],
    covariances: Sequence[ArrayLike],
    confidence: float = CONFIDENCE,
) -> bool:
    """Whether all true positions (3,) lie inside the regions around the recovered ones.

    Of several lights each region is widened such that all of them together hold with `confidence` (Šidák).
    """
    each = confidence ** (1.0 / max(1, len(estimates)))
    found = [squared_distance(*parts) for parts in zip(estimates, truths, covariances, strict=True)]
    return all(known == 0 or distance <= _quantile(each, known) for distance, known in found)


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
    first, second = (2.0 * np.sqrt(np.clip(values[::-1], 0.0, None) * _quantile(confidence, 3))).tolist()
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
    return np.minimum(np.sqrt(np.maximum(values, 0.0) * _quantile(confidence, 3)), longest), axes


def _quantile(share: float, coordinates: int) -> float:
    """The squared distance that χ² over so many coordinates stays within in this share of the cases.

    By its definition: scipy.stats, which has it by name, is slow to import.
    """
    return float(2.0 * gammaincinv(0.5 * coordinates, share))
