"""What each surfel sends out, measured: least squares over all photographs of one light.

A diffuse surfel has one radiance in all photographs, whatever its albedo and whatever lights it. So the images are
linear in the N radiances, with the weights W of the views, and g_v the exposures:

    min over L, g of  Σ_p w_p ( I_p − g_p (W L)_p )² / ( (W L)_p + b )² .

Pixels are off by a part of what they show, and b keeps that from meaning too much in the dark. Weighed all alike, the
light beside dark paint that is little wider than surfels outweighs what shows the paint itself, which then comes out
grey, or less than black. w_p gives little weight to what most pixels contradict (Cauchy's loss on the relative error):
edges that are not quite where the surfels have them, gloss, people who walked by. Pixels half outside of all surfaces
do not count. Saturated ones tell only that it is at least so bright: they count for little, so that what another
photograph shows of the same surface decides, and where none shows more L is the least that it may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import torch
from numpy.typing import NDArray

from rgspipe.capture.exposures import Cameras, Exposure
from rgspipe.capture.photographs import SHOWN, Numbers, TracedPhotograph
from rgspipe.datasets.views import View
from rgspipe.optim.conjugate_gradients import conjugate_gradients, steps_to
from rgspipe.renderer.view_weights import ViewWeights

#: Surfels with a larger part of their pixels saturated in a channel, of those that the others do not contradict, are
#: brighter than these say.
MOST_CLIPPED = 0.3

#: Rounds of reweighting.
ROUNDS = 4

#: Draws of the pixels' errors and of the albedo, by which variances are known to a fifth, deviations to a tenth.
DRAWS = 48

#: Relative error at which a pixel counts half, in medians of all.
OUTLIER = 3.0

#: Pull towards the mean of the pixels, over the weight of the pixels: neighbours overlap, so that their difference is
#: known worse than their mean. The mean is smoother than the radiance is, which costs light where it changes fast: in a
#: painted room a pull of 0.05 leaves the intensities of lamps 5 % too small, one of 0.01 has them 1 % too large.
PULL = 0.01

#: Weight of pixels that every surfel has, so that one that no pixel shows has a number, too.
LEAST_SEEN = 1e-7

#: Of what a round changes no more than this is left undone, and of what pixels' errors make of the radiance: its
#: variance is known to a fifth.
SOLVED, DRAWN = 1e-6, 0.01

#: Part of the bright pixels' radiance that is added to a pixel's own before errors are relative to it.
FLOOR = 0.02


@dataclass(frozen=True, eq=False)
class Measured:
    """Radiance of N surfels in V photographs.

    Attributes:
        radiance: (N, 3) in the photographs' unit, above 0; the least that it may be where it is blown out; what no
            photograph shows has the median.
        variance: (N,) of its logarithm, by how far pixels are off; infinite where none was seen.
        seen: (N,) pixels that show the surfel, all together.
        cameras: exposures, white balance and vignetting of the photographs.
        error: median relative error of a pixel.
        apart: (N,) mean relative error of the pixels that show each surfel, outliers and all.
        shown_by: (N,) photographs that show it.
        blown_out: (N, 3) bool: so much of a channel is saturated, in every photograph, that it is known from below.
    """

    radiance: Numbers
    variance: Numbers
    seen: Numbers
    cameras: Cameras
    error: float
    apart: Numbers
    shown_by: NDArray[np.int64]
    blown_out: NDArray[np.bool_]


def measured_radiance(
    weights: Sequence[ViewWeights],
    views: Sequence[View],
    *,
    exposure: Exposure = "same",
    vignetting: bool = False,
    bent: bool = False,
) -> Measured:
    """The radiance that explains all photographs best.

    Args:
        weights: of the views, on the same N surfels.
        views: V ≥ 1, all under the same light.
        exposure: whether each photograph has an unknown factor, or one in each channel.
        vignetting: whether corners may be darker, alike in all photographs.
        bent: whether the camera's curve may be another than that by which they were decoded.
    """
    photographs = [TracedPhotograph.of(*pair) for pair in zip(weights, views, strict=True)]
    cameras, radiance = Cameras.of(len(views), exposure, vignetting, bent), None
    counted, floor = [photograph.base for photograph in photographs], _floor(photographs)
    precision = [np.ones_like(weight) for weight in counted]
    for _ in range(ROUNDS):
        plain = [one.plain(weight) for one, weight in zip(photographs, counted, strict=True)]
        cameras = cameras.fitted(photographs, plain, radiance)
        parts = zip(photographs, counted, precision, strict=True)
        believed = [one.believed(weight) * precise for one, weight, precise in parts]
        normal = _normal(photographs, believed)
        radiance = _radiance(photographs, cameras, believed, normal, radiance)
        off, expected = _errors(photographs, cameras, radiance, floor)
        relative = [part / whole for part, whole in zip(off, expected, strict=True)]
        precision = [(floor / whole) ** 2 for whole in expected]
        error = _typical(photographs, relative)
        latest, limit = counted, max(OUTLIER * error, 1e-6)
        counted = [one.base / (1.0 + (part / limit) ** 2) for one, part in zip(photographs, relative, strict=True)]
    variance = _log_variance(photographs, believed, off, normal, radiance)
    seen, clipped = _shown(photographs, latest)
    known, blown_out = seen > 0.0, clipped > MOST_CLIPPED * seen[:, None]
    middle = np.median(radiance[known], axis=0) if known.any() else np.ones(3)
    least = 1e-6 * np.maximum(middle, 1e-300)
    radiance = np.where(known[:, None], np.maximum(radiance, least), middle)
    shown_by = sum((_pixels(view) > SHOWN).astype(np.int64) for view in weights)
    variance = np.where(known, variance, np.inf)
    return Measured(radiance, variance, seen, cameras, error, _apart(photographs, relative), shown_by, blown_out)


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations of N radiances, as the pixels of all photographs weigh.

    Attributes:
        matrix: (N, N) Σ_v Wᵀ w W, and the pull.
        seen: (N,) weight of the pixels that show each surfel, never 0.
    """

    matrix: sp.csr_matrix
    seen: Numbers

    def solved(self, right: Numbers, share: float, start: Numbers) -> Numbers:
        """(N, K) what belongs to `right` (N, K), with a `share` of the error of `start` (N, K) at most.

        The weights of a pixel sum to 1 or less, so that over `seen` the matrix has no eigenvalue above 1 + PULL, and
        none below PULL. Surfels of overlapping pixels fill a factorisation.
        """
        over = torch.from_numpy(self.seen)[:, None]
        step = conjugate_gradients(
            lambda x: torch.from_numpy(self.matrix @ x.numpy()),
            torch.from_numpy(right - self.matrix @ start),
            lambda x: x / over,
            steps_to(share, (1.0 + PULL) / PULL),
        )
        return start + step.numpy()


def _floor(photographs: Sequence[TracedPhotograph]) -> float:
    """Radiance that is added before errors are relative."""
    grey = np.concatenate(
        [photograph.image.mean(axis=1)[photograph.plain(photograph.base) > 0.0] for photograph in photographs]
    )
    # Where nearly all is black, the brightest pixel has to do.
    return FLOOR * float(np.quantile(grey, 0.99) or grey.max() or 1.0) if len(grey) else 1.0


def _errors(
    photographs: Sequence[TracedPhotograph], cameras: Cameras, radiance: Numbers, floor: float
) -> tuple[list[NDArray[np.float32]], list[NDArray[np.float32]]]:
    """(P,) of each photograph how far pixels are off, and what they should be, which that is relative to."""
    off, expected = [], []
    for photograph, even in zip(photographs, cameras.even(photographs), strict=True):
        shown = photograph.rows @ radiance
        off.append((even - shown).mean(axis=1).astype(np.float32))
        expected.append((shown.mean(axis=1) + floor).astype(np.float32))
    return off, expected


def _typical(photographs: Sequence[TracedPhotograph], relative: Sequence[NDArray[np.float32]]) -> float:
    """The median of relative errors (P,) of plain pixels."""
    pairs = zip(photographs, relative, strict=True)
    plain = [np.abs(part[photograph.plain(photograph.base) == 1.0]) for photograph, part in pairs]
    every = np.concatenate(plain)
    return float(np.median(every)) if len(every) else 0.0


def _apart(photographs: Sequence[TracedPhotograph], relative: Sequence[NDArray[np.float32]]) -> Numbers:
    """(N,) mean of relative errors (P,) over the pixels that show each surfel."""
    off, shown = 0.0, 0.0
    for photograph, part in zip(photographs, relative, strict=True):
        back, plain = photograph.rows.T, photograph.plain(photograph.base)
        off, shown = off + back @ (plain * np.abs(part)), shown + back @ plain
    return off / np.maximum(shown, 1e-12)


def _pixels(weights: ViewWeights) -> Numbers:
    """(N,) pixels that show each surfel, all together."""
    return np.asarray(weights.operator.to_scipy().sum(axis=0)).ravel()


def _shown(photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers]) -> tuple[Numbers, Numbers]:
    """(N,) pixels that show each surfel, and (N, 3) those of them that are saturated, by weights (P,) of pixels."""
    shown, saturated = 0.0, 0.0
    for photograph, weight in zip(photographs, weights, strict=True):
        back = photograph.rows.T
        shown, saturated = shown + back @ weight, saturated + back @ (photograph.saturated * weight[:, None])
    return shown, saturated


def _normal(photographs: Sequence[TracedPhotograph], weights: Sequence[Numbers]) -> _Normal:
    """The normal equations of pixels that count `weights` (P,)."""
    seen, matrix = 0.0, 0.0
    for photograph, weight in zip(photographs, weights, strict=True):
        weighted = photograph.rows.multiply(weight[:, None].astype(np.float64)).tocsr()
        seen = seen + np.asarray(weighted.sum(axis=0)).ravel()
        matrix = matrix + photograph.rows.T @ weighted
    seen = seen + LEAST_SEEN
    return _Normal((matrix + sp.diags(PULL * seen)).tocsr(), seen)


def _radiance(
    photographs: Sequence[TracedPhotograph],
    cameras: Cameras,
    weights: Sequence[Numbers],
    normal: _Normal,
    before: Numbers | None,
) -> Numbers:
    """(N, 3) radiance, from that of the round `before`."""
    right = 0.0
    for photograph, even, weight in zip(photographs, cameras.even(photographs), weights, strict=True):
        right = right + photograph.rows.T @ (weight[:, None].astype(np.float64) * even)
    mean = right / normal.seen[:, None]
    start = mean if before is None else before
    return np.maximum(normal.solved(right + PULL * right, SOLVED, start), 0.0)


def _log_variance(
    photographs: Sequence[TracedPhotograph],
    weights: Sequence[Numbers],
    off: Sequence[NDArray[np.float32]],
    normal: _Normal,
    radiance: Numbers,
) -> Numbers:
    """(N,) variance of the logarithm of the radiance, by draws of the signs of what pixels are `off` (P,) by."""
    rng, drawn = np.random.default_rng(0), 0.0
    for photograph, weight, part in zip(photographs, weights, off, strict=True):
        signs = 2.0 * rng.integers(0, 2, (len(part), DRAWS), dtype=np.int8) - 1.0
        drawn = drawn + photograph.rows.T @ ((weight * part)[:, None] * signs)
    squared = (normal.solved(drawn, DRAWN, np.zeros_like(drawn)) ** 2).mean(axis=1)
    grey = radiance.mean(axis=1)
    return np.where(grey > 0.0, squared / np.where(grey > 0.0, grey, 1.0) ** 2, np.inf)
