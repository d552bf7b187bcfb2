"""What albedo is found from: images, how much each pixel counts, and what is known besides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.scene.surfels import Surfels
from rgspipe.training.levels import levels
from rgspipe.training.likeness import nearest_surfels
from rgspipe.training.view_model import LitViewModel

#: Albedo stays within these: below is numerically black, above rooms that never darken.
ALBEDO_RANGE = (0.005, 0.98)

#: Part of a view's level below which pixels count as dark: their errors are absolute.
DARK = 0.1

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
        levels: V scalars that errors are measured against.
        pixel_weights: V weights (pixels,) of squared errors: relative in bright pixels, absolute in dark.
        neighbours: (N, 6) nearest surfels by position and normal.
    """

    models: Sequence[LitViewModel]
    images: Sequence[Tensor]
    levels: Sequence[Tensor]
    pixel_weights: Sequence[Tensor]
    neighbours: Tensor

    @classmethod
    def build(cls, surfels: Surfels, models: Sequence[LitViewModel], views: Sequence[View]) -> AlbedoProblem:
        """That of views, each with how it sees the surfels under its light."""
        images = [view.image.reshape(-1, 3).float() for view in views]
        albedo = surfels.albedo.float().clamp(*ALBEDO_RANGE)
        scales = levels(images, [model.image(albedo, None) for model in models])
        parts = zip(views, models, scales, strict=True)
        pixel_weights = [pixel_weight(view, model.weights.coverage, scale) for view, model, scale in parts]
        return cls(models, images, scales, pixel_weights, nearest_surfels(surfels.centers, surfels.normals))

    def render(self, v: int, albedo: Tensor, indirect: Tensor | None) -> Tensor:
        """(pixels, 3) view v under `indirect` (V, N, 3)."""
        return self.models[v].image(albedo, None if indirect is None else indirect[v])


def pixel_weight(view: View, coverage: Tensor, scale: Tensor) -> Tensor:
    """(P,) weights of errors that are measured against the level `scale`.

    None where surfels and photograph disagree on what is covered, which is for the geometry, and none where the
    photograph is saturated.
    """
    image, alpha = view.image.reshape(-1, 3).float(), view.alpha.reshape(-1).float()
    weight = 1.0 / (image.mean(dim=1) / scale + DARK) / scale.square()
    trusted = (coverage >= MINIMUM_COVERAGE) & ((alpha - coverage).abs() <= COVERAGE_MISMATCH)
    trusted &= ~view.saturated.reshape(-1, 3).any(dim=1)
    return torch.where(trusted, weight, torch.zeros_like(weight))


def robust_weights(
    images: Sequence[Tensor], scales: Sequence[Tensor], weights: Sequence[Tensor], renders: Sequence[Tensor]
) -> list[Tensor]:
    """Pixel weights with those that fit badly weighing less: pixels of a view (shadow edges, occlusions), and views as
    a whole (a lamp that something unseen shades)."""
    errors = [_relative(*view) for view in zip(images, scales, renders, strict=True)]
    typical = [_typical(error[weight > 0]) for error, weight in zip(errors, weights, strict=True)]
    usual = _typical(torch.stack(typical)) if typical else torch.tensor(1.0)
    parts = zip(weights, errors, typical, strict=True)
    return [weight * _less(error, own) * _less(own, usual) for weight, error, own in parts]


def _relative(image: Tensor, scale: Tensor, render: Tensor) -> Tensor:
    """(P,) errors of pixels over what they show."""
    return (render - image).abs().mean(dim=1) / (image.mean(dim=1) + DARK * scale)


def _typical(errors: Tensor) -> Tensor:
    """Errors that are larger are few."""
    return 3.0 * errors.median() + 1e-4 if len(errors) else torch.tensor(1.0)


def _less(error: Tensor, typical: Tensor) -> Tensor:
    return 1.0 / (1.0 + (error / typical).square())
