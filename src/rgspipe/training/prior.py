"""Albedo maps of the training views, from any method that splits images into albedo and shading, as a prior on surfels.

Such maps are noisy, disagree where the method took a shadow for paint, and know albedo only up to a scale that differs
from image to image. So one scale a view and channel is found together with the surfels' albedo, by least squares that
are reweighted until what disagrees counts for little, and where the views do not agree the prior weighs little.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels
from rgspipe.training.albedo import AlbedoPrior
from rgspipe.training.materials import PriorOf, each_view

#: A surfel that fewer pixels than this see in a view, all together, has no value in it.
LEAST_PIXELS = 0.05

#: Pixels with less surface than this are mixed with what is behind.
LEAST_COVERAGE = 0.9

#: Reflectances below count as this: their logarithms say nothing.
DARKEST = 0.01

#: Spread of log-albedo over the views at which a surfel's prior weighs half.
HALF_SPREAD = 0.3

#: Difference of log-albedo from the common one at which a view's value counts half (Cauchy).
OUTLIER = 0.1

#: Rounds of reweighting.
ROUNDS = 10

#: What asks training for a prior, and what does without.
FROM_MAPS, NO_PRIOR = "prior_from_maps(views)", "rg.train(prior=None)"


def albedo_prior(
    weights: Iterable[ViewWeights], views: Sequence[View], asked: str = FROM_MAPS, otherwise: str = NO_PRIOR
) -> tuple[Tensor, Tensor]:
    """Albedo that the views' albedo maps agree on.

        log a_vi = log s_v + log ρ_i

    with a_vi what surfel i has in the map of view v: its pixels' mean by view weights, away from edges. The median of
    log s_v over the views is 0, so what all maps are too bright by stays in ρ: see `rescaled`.

    Args:
        weights: view weights of the V views on N surfels.
        views: those with an albedo map count.
        asked: what asks for a prior, for errors.
        otherwise: what does without.

    Returns:
        albedo (N, 3) in [DARKEST, 1], and weight (N,) in [0, 1]: 1/(1 + (spread/HALF_SPREAD)²) by the spread of
        log-albedo over the views, 0 for surfels that no map shows.

    Raises:
        InputError: no view has an albedo map.
    """
    _require_maps(views, asked, otherwise)
    pairs = ((weight, view) for weight, view in zip(weights, views, strict=True) if view.albedo is not None)
    logs, shares = (torch.stack(parts) for parts in zip(*(_on_surfels(*pair) for pair in pairs), strict=True))
    channels = [_common(logs[:, :, channel], shares) for channel in range(3)]
    albedo = torch.stack([common for common, _ in channels], dim=1).exp().clamp(DARKEST, 1.0)
    spread = torch.stack([spread for _, spread in channels]).amax(dim=0)
    weight = torch.where(shares.sum(dim=0) > 0, 1.0 / (1.0 + (spread / HALF_SPREAD).square()), 0.0)
    return albedo, weight


def _common(logs: Tensor, shares: Tensor) -> tuple[Tensor, Tensor]:
    """Log-albedo (N,) that log-values (V, N) with weights (V, N) agree on up to a shift a view, and their spread (N,).

    min over s, r of Σ_vi w_vi (l_vi − s_v − r_i)² ; r is eliminated, which leaves V equations for s.
    """
    weights, common, spread = shares, logs, logs
    for _ in range(ROUNDS):
        total = weights.sum(dim=0).clamp(min=1e-9)
        mean = (weights * logs).sum(dim=0) / total
        laplacian = torch.diag(weights.sum(dim=1)) - (weights / total) @ weights.T
        right = (weights * (logs - mean)).sum(dim=1)
        # Views that share no surfel know nothing of each other's scale: the least solution leaves them alone.
        scales = torch.linalg.pinv(laplacian.double(), rtol=1e-6, hermitian=True) @ right.double()
        shifted = logs - (scales - scales.median())[:, None].to(logs)
        common = (weights * shifted).sum(dim=0) / total
        error = shifted - common
        spread = ((shares * error.square()).sum(dim=0) / shares.sum(dim=0).clamp(min=1e-9)).sqrt()
        weights = shares / (1.0 + (error / OUTLIER).square())
    return common, spread


def prior_from_maps(views: Sequence[View], strength: float) -> PriorOf:
    """A prior for `fit_materials` from the views' albedo maps, in the scale of the albedo that the surfels have.

    Args:
        strength: how much a value that all maps agree on counts against the images, which weigh 1 in the median surfel.

    Raises:
        InputError: no view has an albedo map.
    """
    _require_maps(views, FROM_MAPS, NO_PRIOR)

    def prior(surfels: Surfels) -> AlbedoPrior:
        # Edges are left out, so one ray a pixel says enough.
        there = [view.to(surfels.centers.device) for view in views]
        albedo, weight = albedo_prior(each_view(surfels, there, supersampling=1), there)
        return AlbedoPrior(rescaled(albedo, weight, surfels.albedo), strength * weight)

    return prior


def rescaled(prior: Tensor, weight: Tensor, albedo: Tensor) -> Tensor:
    """The prior (N, 3) with one scale a channel, so that it is most like `albedo` (N, 3), which images under known
    lights gave: they know the scale that the maps do not.

    Args:
        weight: (N,) of the surfels' priors.
    """
    ratio = albedo.clamp(min=DARKEST).log() - prior.clamp(min=DARKEST).log()
    return (prior * _median(ratio, weight).exp()).clamp(0.0, 1.0)


def _median(values: Tensor, weights: Tensor) -> Tensor:
    """(3,) weighted medians of (N, 3) with weights (N,); 0 where all weights are 0."""
    order = values.argsort(dim=0)
    heights = weights[order].cumsum(dim=0)
    half = (heights < 0.5 * heights[-1]).sum(dim=0).clamp(max=len(values) - 1)
    median = values.gather(0, order).gather(0, half[None])[0]
    return torch.where(heights[-1] > 0, median, 0.0)


def _require_maps(views: Sequence[View], asked: str, otherwise: str) -> None:
    if all(view.albedo is None for view in views):
        raise InputError(
            asked,
            expected="training views with albedo maps",
            found=f"none in {len(views)} views",
            remedy=f'Give their frames an "albedo_path", or use {otherwise}.',
        )


def _on_surfels(weights: ViewWeights, view: View) -> tuple[Tensor, Tensor]:
    """Log-albedo (N, 3) of the surfels in the map of a view, and how many pixels (N,) say so."""
    assert view.albedo is not None
    albedo = view.albedo.reshape(-1, 3).float()
    good = (weights.coverage >= LEAST_COVERAGE) & ~weights.edges & albedo.isfinite().all(dim=1)
    used = (good & (albedo > 0.0).any(dim=1)).float()[:, None]
    gathered = weights.operator.transposed @ torch.cat([used * albedo.nan_to_num(), used], dim=1)
    pixels = gathered[:, 3]
    share = torch.where(pixels >= LEAST_PIXELS, pixels, 0.0)
    return (gathered[:, :3] / pixels.clamp(min=1e-9)[:, None]).clamp(min=DARKEST).log(), share
