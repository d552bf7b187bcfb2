"""The pixels that unknown lights have to explain, and what a light of any kind would show there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.fitting.gloss import seen_with_gloss
from rgspipe.fitting.moments import Moments, moments
from rgspipe.fitting.parameters import Emitter, share_slopes, shared
from rgspipe.fitting.views import PreparedViews
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.pixel_direct import surfel_shares
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spot_share import spot_share_slopes

#: In relative weights 1/(y + floor·mean y): pixels darker than this share of the mean count no more than it does.
RELATIVE_FLOOR = 0.05


@dataclass(frozen=True)
class Effects:
    """Which parts of light transport a fit's model has."""

    shadows: bool = True
    interreflection: bool = True
    #: Direct light where pixels look, in the last steps of a fit and in its images; else at surfels' centres.
    at_pixels: bool = False


@dataclass(frozen=True)
class LightProblem:
    """Find the light whose image is the target.

    Attributes:
        views: the pixels that are used.
        target: (P, 3) float32 their radiance over `scale`, so that its mean is 1 and neither very bright nor
            very dim images leave the range of float32.
        scale: mean radiance of the target; 0 if it is black.
        effects: parts of light transport.
        at_pixels: whether direct light is taken where pixels look; see `sharpest`.
    """

    views: PreparedViews
    target: Tensor
    scale: float
    effects: Effects
    at_pixels: bool = False

    @classmethod
    def create(cls, views: PreparedViews, stacked: Tensor, effects: Effects | None = None) -> LightProblem:
        """The problem for images stacked by `PreparedViews.stack_images`, (all pixels, 3)."""
        target = stacked[views.pixels].double()
        scale = max(0.0, float(target.mean()))
        normalised = target / scale if scale > 0.0 else target
        if not bool(torch.isfinite(normalised).all()):
            scale, normalised = 0.0, torch.zeros_like(target)
        return cls(views, normalised.float(), scale, effects or Effects())

    @property
    def black(self) -> bool:
        """Whether there is nothing to explain."""
        return self.scale == 0.0

    def evaluate(self, emitter: Emitter) -> Tensor:
        """(P, 3, 1 + d) float32 image of a unit light, and its derivatives towards the emitter's natural parameters.

        Derivatives are per scene unit and rad; see `Emitter`.
        """
        frozen = self.views.frozen
        if self.at_pixels:
            return self._evaluate_at_pixels(emitter)
        irradiance, slope = unit_irradiance(frozen.bvh, emitter.position[None], self.effects.shadows)
        lightings = self._on_surfels(emitter, torch.cat([irradiance[0, :, None], slope[0]], dim=1))
        if frozen.gloss is not None:
            return seen_with_gloss(self.views, emitter.position, lightings, self.effects.interreflection)
        radiance = frozen.radiance(lightings, self.effects.interreflection)
        return _seen(self.views.operator, radiance)

    def _evaluate_at_pixels(self, emitter: Emitter) -> Tensor:
        """`evaluate` with direct light where pixels look; what bounces still starts from surfels' centres."""
        frozen, position = self.views.frozen, emitter.position
        share, share_slope = surfel_shares(frozen.bvh, position, self.effects.shadows)
        images = [direct.image(position, share, share_slope) for direct in self.views.pixel_direct]
        for index, highlights in enumerate(self.views.highlights):
            images[index] = images[index] + highlights.image(position, share, share_slope)
        columns = torch.cat(images)[self.views.pixels]
        if emitter.is_spot:
            columns = _times_share(emitter, self.views.points, columns)
        if not self.effects.interreflection:
            return columns
        factor, slope = unit_irradiance(frozen.bvh, position[None], shadows=False)
        slope = slope[0] * share[:, None] + factor[0, :, None] * share_slope
        lightings = self._on_surfels(emitter, torch.cat([(factor[0] * share)[:, None], slope], dim=1))
        if frozen.gloss is not None:
            return columns + seen_with_gloss(self.views, position, lightings, True, bounced_only=True)
        bounced = frozen.radiance(lightings) - frozen.radiance(lightings, indirect=False)
        return columns + _seen(self.views.operator, bounced)

    def _on_surfels(self, emitter: Emitter, lightings: Tensor) -> Tensor:
        """A point light's irradiance and derivatives (N, 4), as the emitter's (N, 1 + d)."""
        return _times_share(emitter, self.views.frozen.bvh.surfels.centers, lightings) if emitter.is_spot else lightings

    def sharpest(self) -> LightProblem:
        """The same problem with direct light where pixels look, if the views were made ready for that."""
        return replace(self, at_pixels=bool(self.views.pixel_direct))

    def moments(self, columns: Sequence[Tensor], weights: Tensor) -> Moments:
        """Weighted moments of the lights' evaluations against the target."""
        return moments(columns, self.target, weights)

    def residual(self, columns: Sequence[Tensor], intensity: Tensor) -> Tensor:
        """(P, 3) float32 target − image at intensities (L, 3), both over `scale`."""
        residual = self.target
        for light, strength in zip(columns, intensity, strict=True):
            residual = residual - light[:, :, 0] * strength.to(light)
        return residual

    def relative_weights(self) -> Tensor:
        """(P, 1) weights that make errors relative to the pixel's own brightness."""
        return 1.0 / (self.target.mean(dim=1, keepdim=True).clamp(min=0.0) + RELATIVE_FLOOR)

    @staticmethod
    def block_weights(target: Tensor, counts: Tensor) -> Tensor:
        """(B, 3) squared relative weights of block averages (B, 3) over `counts` (B,) pixels each."""
        relative = 1.0 / (target.mean(dim=1).clamp(min=0.0) + RELATIVE_FLOOR)
        return (counts * relative.square())[:, None].expand(target.shape)

    def unexplained(self, columns: Sequence[Tensor], intensity: Tensor) -> float:
        """Σ (target − image)² / Σ target², the loss that is reported: 0 is a perfect fit, 1 a black image."""
        energy = float(self.target.double().square().sum())
        return float(self.residual(columns, intensity).double().square().sum()) / energy if energy > 0.0 else 0.0


def _times_share(emitter: Emitter, points: Tensor, columns: Tensor) -> Tensor:
    """A point light's columns (N, …, 4) at `points` (N, 3) as those of a spot, (N, …, 1 + d)."""
    share = spot_share_slopes(points, emitter.position, emitter.axis, emitter.shape, emitter.softness)
    return shared(columns, share.value, share_slopes(emitter, share))


def _seen(operator: SparseOperator, radiance: Tensor) -> Tensor:
    """(P, 3, K) images of radiance (N, 3, K)."""
    return (operator @ radiance.reshape(len(radiance), -1)).reshape(-1, 3, radiance.shape[2])
