"""What each surfel sends out, measured: least squares over all photographs of one light.

A diffuse surfel has one radiance in all photographs, whatever its albedo and whatever lights it. So the images are
linear in the N radiances, with the weights W of the views, and g_v the exposures:

    min over L, g of  Σ_p w_p ( I_p − g_v(p) (W L)_p )² .

w_p gives little weight to what most pixels contradict (Cauchy's loss on the relative error): edges that are not quite
where the surfels have them, gloss, people who walked by. Saturated pixels and those half outside of all surfaces do
not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from rgspipe.datasets.views import View
from rgspipe.renderer.view_weights import ViewWeights

Numbers = NDArray[np.float64]

#: Pixels with less surface than this are mixed with what is behind.
LEAST_COVERAGE = 0.9

#: Weight of pixels beside edges: they say where nothing else does.
EDGE_WEIGHT = 0.03

#: Surfels with a larger part of their pixels saturated are brighter than the rest of them say.
MOST_CLIPPED = 0.3

#: Rounds of reweighting.
ROUNDS = 4

#: Draws of the pixels' errors, by which variances are known to a fifth.
DRAWS = 48

#: Relative error at which a pixel counts half, in medians of all.
OUTLIER = 3.0

#: Pull towards the mean of the pixels, over the weight of the pixels: neighbours overlap, so that their difference is
#: known worse than their mean. The mean is smoother than the radiance is, which costs light where it changes fast: in a
#: painted room a pull of 0.05 leaves the intensities of lamps 5 % too small, one of 0.01 has them 1 % too large.
PULL = 0.01

#: Part of the bright pixels' radiance that is added to a pixel's own before errors are relative to it.
FLOOR = 0.02


@dataclass(frozen=True, eq=False)
class Measured:
    """Radiance of N surfels in V photographs.

    Attributes:
        radiance: (N, 3) in the photographs' unit, above 0; what is not seen has the median.
        variance: (N,) of its logarithm, by how far pixels are off; infinite where none was seen.
        seen: (N,) pixels that show the surfel, all together.
        exposures: (V,) factors of the photographs, of mean logarithm 0.
        error: median relative error of a pixel.
    """

    radiance: Numbers
    variance: Numbers
    seen: Numbers
    exposures: Numbers
    error: float


def measured_radiance(
    weights: Sequence[ViewWeights], views: Sequence[View], *, free_exposure: bool = False
) -> Measured:
    """The radiance that explains all photographs best.

    Args:
        weights: of the views, on the same N surfels.
        views: V ≥ 1, all under the same light.
        free_exposure: whether each photograph has an unknown factor.
    """
    rows = sp.vstack([view.operator.to_scipy() for view in weights], format="csr").astype(np.float64)
    image = np.concatenate([view.image.reshape(-1, 3).double().numpy() for view in views])
    of_view = np.repeat(np.arange(len(views)), [view.camera.pixel_count for view in views])
    base = np.concatenate([_base(*pair) for pair in zip(weights, views, strict=True)])
    exposures, robust, shown = np.ones(len(views)), np.ones(len(base)), None
    floor = FLOOR * np.quantile(image.mean(axis=1)[base > 0.0], 0.99) if (base > 0.0).any() else 1.0
    for _ in range(ROUNDS):
        weight = base * robust
        if free_exposure:
            exposures = _exposures(rows, image.mean(axis=1), of_view, weight, shown)
        level = exposures[of_view][:, None]
        radiance, seen, normal = _radiance(rows, image / level, weight)
        shown = (rows @ radiance).mean(axis=1)
        off = (image / level).mean(axis=1) - shown
        relative = off / (shown + floor)
        error = float(np.median(np.abs(relative[base == 1.0]))) if (base == 1.0).any() else 0.0
        robust = 1.0 / (1.0 + (relative / max(OUTLIER * error, 1e-6)) ** 2)
    variance = _log_variance(rows, weight, off, normal, radiance)
    seen = np.where(_clipped(rows, views) > MOST_CLIPPED, 0.0, seen)
    known = seen > 0.0
    middle = np.median(radiance[known], axis=0) if known.any() else np.ones(3)
    least = 1e-6 * np.maximum(middle, 1e-300)
    radiance = np.where(known[:, None], np.maximum(radiance, least), middle)
    return Measured(radiance, np.where(known, variance, np.inf), seen, exposures, error)


def _base(weights: ViewWeights, view: View) -> Numbers:
    """(P,) what pixels count before they are looked at."""
    whole = (weights.coverage >= LEAST_COVERAGE).cpu() & ~view.saturated.any(dim=-1).reshape(-1)
    whole &= view.alpha.reshape(-1) >= LEAST_COVERAGE
    edges = weights.edges.cpu()
    return np.where(edges.numpy(), EDGE_WEIGHT, 1.0) * whole.double().numpy()


def _clipped(rows: sp.csr_matrix, views: Sequence[View]) -> Numbers:
    """(N,) part of the pixels of each surfel that are saturated."""
    saturated = np.concatenate([view.saturated.any(dim=-1).reshape(-1).double().numpy() for view in views])
    return (rows.T @ saturated) / np.maximum(np.asarray(rows.sum(axis=0)).ravel(), 1e-12)


def _radiance(rows: sp.csr_matrix, image: Numbers, weight: Numbers) -> tuple[Numbers, Numbers, sp.linalg.SuperLU]:
    """(N, 3) radiance, (N,) how much of the pixels shows each surfel, and the normal equations."""
    weighted = rows.multiply(weight[:, None]).tocsr()
    seen = np.asarray(weighted.sum(axis=0)).ravel()
    mean = (weighted.T @ image) / np.maximum(seen, 1e-12)[:, None]
    pull = PULL * seen + 1e-9
    normal = factorised((rows.T @ weighted + sp.diags(pull)).tocsc())
    right = weighted.T @ image + pull[:, None] * mean
    return np.maximum(normal.solve(right), 0.0), seen, normal


def _exposures(
    rows: sp.csr_matrix, grey: Numbers, of_view: NDArray[np.intp], weight: Numbers, shown: Numbers | None
) -> Numbers:
    """(V,) factors by which photographs of the same surfels differ, of mean logarithm 0.

    Args:
        grey: (P,) pixels.
        shown: (P,) what they would be without the factors; None before anything is known of it.
    """
    count = int(of_view.max()) + 1
    if shown is None:
        return _first_exposures(
            rows, grey, sp.csr_matrix((weight, (of_view, np.arange(len(weight)))), (count, len(grey)))
        )
    over, under = (np.bincount(of_view, weight * values, count) for values in (grey * shown, shown**2))
    gains = np.log(np.where(over > 0.0, over, 1.0) / np.where(over > 0.0, under, 1.0))
    return np.exp(gains - gains.mean())


def _first_exposures(rows: sp.csr_matrix, grey: Numbers, views: sp.csr_matrix) -> Numbers:
    """The same by surfels' means: their logarithms l_vi are g_v + r_i, and r is eliminated.

    Args:
        views: (V, P) the pixels' weights in the row of their photograph.
    """
    shown = (views @ rows).toarray()
    mean = (views @ rows.multiply(grey[:, None]).tocsr()).toarray() / np.maximum(shown, 1e-12)
    counted = np.where((shown >= 1.0) & (mean > 0.0), shown, 0.0)
    logs = np.log(np.where(counted > 0.0, mean, 1.0))
    total = np.maximum(counted.sum(axis=0), 1e-12)
    laplacian = np.diag(counted.sum(axis=1)) - (counted / total) @ counted.T
    right = (counted * (logs - (counted * logs).sum(axis=0) / total)).sum(axis=1)
    gains = np.linalg.lstsq(laplacian, right, rcond=1e-9)[0]
    return np.exp(gains - gains.mean())


def _log_variance(
    rows: sp.csr_matrix, weight: Numbers, off: Numbers, normal: sp.linalg.SuperLU, radiance: Numbers
) -> Numbers:
    """(N,) variance of the logarithm of the radiance, by draws of what pixels are `off` (P,) by."""
    rng = np.random.default_rng(0)
    noise = (weight * off)[:, None] * rng.standard_normal((len(off), DRAWS))
    squared = (normal.solve(rows.T @ noise) ** 2).mean(axis=1)
    grey = radiance.mean(axis=1)
    return np.where(grey > 0.0, squared / np.where(grey > 0.0, grey, 1.0) ** 2, np.inf)


def factorised(matrix: sp.csc_matrix) -> sp.linalg.SuperLU:
    """A symmetric positive definite matrix, factorised."""
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
