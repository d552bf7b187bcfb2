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

#: Rounds of reweighting, and steps that exposures and radiance take in turn.
ROUNDS, TURNS = 4, 30

#: Relative error at which a pixel counts half, in medians of all.
OUTLIER = 3.0

#: Pull towards the mean of the pixels, over the weight of the pixels: neighbours overlap, so that their difference is
#: known worse than their mean.
PULL = 0.05

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
    exposures, robust = np.ones(len(views)), np.ones(len(base))
    floor = FLOOR * np.quantile(image.mean(axis=1)[base > 0.0], 0.99) if (base > 0.0).any() else 1.0
    for _ in range(ROUNDS):
        weight = base * robust
        if free_exposure:
            exposures = _exposures(rows, image, of_view, weight, len(views))
        level = exposures[of_view][:, None]
        radiance, seen = _radiance(rows, image / level, weight)
        shown = rows @ radiance
        relative = (image / level - shown).mean(axis=1) / (shown.mean(axis=1) + floor)
        error = float(np.median(np.abs(relative[base == 1.0]))) if (base == 1.0).any() else 0.0
        robust = 1.0 / (1.0 + (relative / max(OUTLIER * error, 1e-6)) ** 2)
    return _measured(rows, weight, relative * (shown.mean(axis=1) + floor), radiance, seen, exposures, error)


def _base(weights: ViewWeights, view: View) -> Numbers:
    """(P,) what pixels count before they are looked at."""
    whole = (weights.coverage >= LEAST_COVERAGE).cpu() & ~view.saturated.any(dim=-1).reshape(-1)
    whole &= view.alpha.reshape(-1) >= LEAST_COVERAGE
    edges = weights.edges.cpu()
    return np.where(edges.numpy(), EDGE_WEIGHT, 1.0) * whole.double().numpy()


def _radiance(rows: sp.csr_matrix, image: Numbers, weight: Numbers) -> tuple[Numbers, Numbers]:
    """(N, 3) radiance, and (N,) how much of the pixels shows each surfel."""
    weighted = rows.multiply(weight[:, None]).tocsr()
    seen = np.asarray(weighted.sum(axis=0)).ravel()
    mean = (weighted.T @ image) / np.maximum(seen, 1e-12)[:, None]
    pull = PULL * seen + 1e-9
    normal = (rows.T @ weighted + sp.diags(pull)).tocsc()
    right = weighted.T @ image + pull[:, None] * mean
    return np.maximum(factorised(normal).solve(right), 0.0), seen


def _exposures(rows: sp.csr_matrix, image: Numbers, of_view: NDArray[np.intp], weight: Numbers, count: int) -> Numbers:
    """(V,) factors by which photographs of the same surfels differ: means over surfels and over views, in turn."""
    weighted = rows.multiply(weight[:, None]).tocsr()
    seen = np.maximum(np.asarray(weighted.sum(axis=0)).ravel(), 1e-12)
    grey, exposures = image.mean(axis=1), np.ones(count)
    for _ in range(TURNS):
        radiance = (weighted.T @ (grey / exposures[of_view])) / seen
        shown = rows @ radiance
        over = np.bincount(of_view, weight * grey * shown, count)
        exposures = over / np.maximum(np.bincount(of_view, weight * shown**2, count), 1e-300)
        exposures = np.where(exposures > 0.0, exposures, 1.0)
        exposures /= np.exp(np.log(exposures).mean())
    return exposures


def _measured(
    rows: sp.csr_matrix,
    weight: Numbers,
    off: Numbers,
    radiance: Numbers,
    seen: Numbers,
    exposures: Numbers,
    error: float,
) -> Measured:
    """With the variance that pixels which are `off` (P,) by so much leave in the logarithm of each surfel's mean."""
    squares = rows.T @ (weight * off**2)
    grey = np.maximum(radiance.mean(axis=1), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(seen > 0.0, squares / seen**2 / grey**2, np.inf)
    known = seen > 0.0
    middle = np.median(radiance[known], axis=0) if known.any() else np.ones(3)
    least = 1e-6 * np.maximum(middle, 1e-300)
    return Measured(np.where(known[:, None], np.maximum(radiance, least), middle), variance, seen, exposures, error)


def factorised(matrix: sp.csc_matrix) -> sp.linalg.SuperLU:
    """A symmetric positive definite matrix, factorised."""
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
