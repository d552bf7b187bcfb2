"""What each surfel sends out, measured: least squares over all photographs of one light.

A diffuse surfel has one radiance in all photographs, whatever its albedo and whatever lights it. So the images are
linear in the N radiances, with the weights W of the views, and g_v the exposures:

    min over L, g of  Σ_p w_p ( I_p − g_p (W L)_p )² .

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

from rgspipe.capture.exposures import Cameras, Exposure, Numbers
from rgspipe.datasets.views import View
from rgspipe.renderer.view_weights import ViewWeights

#: Pixels with less surface than this are mixed with what is behind.
LEAST_COVERAGE = 0.9

#: Weight of pixels beside edges: they say where nothing else does.
EDGE_WEIGHT = 0.03

#: Pixels, all together, with which a photograph shows a surfel.
SHOWN = 0.3

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
        cameras: exposures, white balance and vignetting of the photographs.
        error: median relative error of a pixel.
        apart: (N,) mean relative error of the pixels that show each surfel, outliers and all.
        shown_by: (N,) photographs that show it.
    """

    radiance: Numbers
    variance: Numbers
    seen: Numbers
    cameras: Cameras
    error: float
    apart: Numbers
    shown_by: NDArray[np.int64]


def measured_radiance(
    weights: Sequence[ViewWeights],
    views: Sequence[View],
    *,
    exposure: Exposure = "same",
    vignetting: bool = False,
) -> Measured:
    """The radiance that explains all photographs best.

    Args:
        weights: of the views, on the same N surfels.
        views: V ≥ 1, all under the same light.
        exposure: whether each photograph has an unknown factor, or one in each channel.
        vignetting: whether corners may be darker, alike in all photographs.
    """
    rows = sp.vstack([view.operator.to_scipy() for view in weights], format="csr").astype(np.float64)
    image = np.concatenate([view.image.reshape(-1, 3).double().numpy() for view in views])
    base = np.concatenate([_base(*pair) for pair in zip(weights, views, strict=True)])
    cameras, robust, shown = Cameras.of(views, exposure, vignetting), np.ones(len(base)), None
    floor = FLOOR * np.quantile(image.mean(axis=1)[base > 0.0], 0.99) if (base > 0.0).any() else 1.0
    for _ in range(ROUNDS):
        weight = base * robust
        cameras = cameras.fitted(rows, image, weight, shown)
        even = image / cameras.level
        radiance, seen, normal = _radiance(rows, even, weight)
        shown = rows @ radiance
        off = (even - shown).mean(axis=1)
        relative = off / (shown.mean(axis=1) + floor)
        error = float(np.median(np.abs(relative[base == 1.0]))) if (base == 1.0).any() else 0.0
        robust = 1.0 / (1.0 + (relative / max(OUTLIER * error, 1e-6)) ** 2)
    variance = _log_variance(rows, weight, off, normal, radiance)
    seen = np.where(_clipped(rows, views) > MOST_CLIPPED, 0.0, seen)
    known = seen > 0.0
    middle = np.median(radiance[known], axis=0) if known.any() else np.ones(3)
    least = 1e-6 * np.maximum(middle, 1e-300)
    radiance = np.where(known[:, None], np.maximum(radiance, least), middle)
    apart = (rows.T @ (base * np.abs(relative))) / np.maximum(rows.T @ base, 1e-12)
    shown_by = sum((_pixels(view) > SHOWN).astype(np.int64) for view in weights)
    return Measured(radiance, np.where(known, variance, np.inf), seen, cameras, error, apart, shown_by)


def _pixels(weights: ViewWeights) -> Numbers:
    """(N,) pixels that show each surfel, all together."""
    return np.asarray(weights.operator.to_scipy().sum(axis=0)).ravel()


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
