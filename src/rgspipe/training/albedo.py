"""What albedo is found from: images, how much each pixel counts, and what is known besides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.scene.surfels import Surfels
from rgspipe.training.likeness import nearest_surfels
from rgspipe.training.view_model import ViewModel

#: Albedo stays within these: below is numerically black, above rooms that never darken.
ALBEDO_RANGE = (0.005, 0.98)

#: Pixels with less surface than this say nothing of it.
MINIMUM_COVERAGE = 0.3

#: … and so do those whose alpha and coverage differ by more: there the surfels end where the object does not.
COVERAGE_MISMATCH = 0.1


@dataclass(frozen=True)
class AlbedoPrior:
    """What is known of the albedo before any image is explained.

    Attributes:
        albedo: (N, 3) expected.
        weight: (N,) how much it counts against the images, which weigh 1 in the median surfel; 0 for not at all.
    """

    albedo: Tensor
    weight: Tensor


@dataclass(frozen=True)
class AlbedoProblem:
    """What stays the same over the rounds.

    Attributes:
        models: of V views.
        images: V images (pixels, 3).
        pixel_weights: V weights (pixels,) of squared errors: relative in bright pixels, absolute in dark.
        neighbours: (N, 6) nearest surfels by position and normal.
    """

    models: Sequence[ViewModel]
    images: Sequence[Tensor]
    pixel_weights: Sequence[Tensor]
    neighbours: Tensor

    @classmethod
    def build(cls, surfels: Surfels, models: Sequence[ViewModel], views: Sequence[View]) -> AlbedoProblem:
        images = [view.image.reshape(-1, 3).float() for view in views]
        pairs = zip(views, models, strict=True)
        pixel_weights = [pixel_weight(view, model.weights.coverage) for view, model in pairs]
        return cls(models, images, pixel_weights, nearest_surfels(surfels.centers, surfels.normals))

    def render(self, v: int, albedo: Tensor, indirect: Tensor | None) -> Tensor:
        """(pixels, 3) view v under `indirect` (V, N, 3)."""
        return self.models[v].image(albedo, None if indirect is None else indirect[v])


def pixel_weight(view: View, coverage: Tensor) -> Tensor:
    """(P,) weights; none where surfels and photograph disagree on what is covered, which is for the geometry, and
    none where the photograph is saturated."""
    image, alpha = view.image.reshape(-1, 3).float(), view.alpha.reshape(-1).float()
    peak = torch.quantile(image, 0.99).clamp(min=1e-12)
    weight = 1.0 / (image.mean(dim=1) / peak + 0.1) / peak.square()
    trusted = (coverage >= MINIMUM_COVERAGE) & ((alpha - coverage).abs() <= COVERAGE_MISMATCH)
    trusted &= ~view.saturated.reshape(-1, 3).any(dim=1)
    return torch.where(trusted, weight, torch.zeros_like(weight))


def robust_weights(images: Sequence[Tensor], weights: Sequence[Tensor], renders: Sequence[Tensor]) -> list[Tensor]:
    """Pixel weights with those that fit badly (shadow edges, occlusions) weighing less."""
    return [_robust(*view) for view in zip(images, weights, renders, strict=True)]


def _robust(image: Tensor, weight: Tensor, render: Tensor) -> Tensor:
    error = (render - image).abs().mean(dim=1)
    relative = error / (image.mean(dim=1) + 0.1 * torch.quantile(image, 0.99)).clamp(min=1e-12)
    used = weight > 0
    typical = 3.0 * relative[used].median() + 1e-4 if bool(used.any()) else torch.tensor(1.0)
    return weight / (1.0 + (relative / typical).square())
