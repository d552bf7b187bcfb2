"""Regions that hold a light in most of the cases, by its covariance."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import gammaincinv

from rgspipe.scene.arrays import ArrayLike

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
    matrix = _array(covariance)
    known = np.isfinite(matrix.diagonal())
    deviation = (_array(estimate) - _array(truth))[known]
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
    return all(known == 0 or distance <= quantile(each, known) for distance, known in found)


def quantile(share: float, coordinates: int) -> float:
    """The squared distance that χ² over so many coordinates stays within in this share of the cases.

    By its definition: scipy.stats, which has it by name, is slow to import.
    """
    return float(2.0 * gammaincinv(0.5 * coordinates, share))


def _array(values: ArrayLike) -> np.ndarray:
    return np.asarray(values, dtype=np.float64)
