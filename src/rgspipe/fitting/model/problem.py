"""The pixels that unknown lights have to explain, and what a light of any kind would show there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.blocks import BlockModel
from rgspipe.fitting.model.capture import SATURATED, ImageCapture, rounding_noise
from rgspipe.fitting.model.differences import central_differences
from rgspipe.fitting.model.emitter import Emitter, shared
from rgspipe.fitting.model.exposure import ExposedMoments, best_factors, moments_by_view
from rgspipe.fitting.model.gloss import seen_with_gloss
from rgspipe.fitting.model.harmonics import BandLimit, emitted_share
from rgspipe.fitting.model.kernels.lit_shares import LEAST_LIT, lit_shares
from rgspipe.fitting.model.moments import Moments, moments
from rgspipe.fitting.model.views import PreparedViews
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.pixel_direct import surfel_shares
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.lights import Share
from rgspipe.sums import average, total

#: In relative weights 1/(y + floor·mean y): pixels darker than this share of the mean count no more than it does.
RELATIVE_FLOOR = 0.05

#: What a model of a scene is wrong by, relative to a pixel: rounding that is larger counts, too.
RELATIVE_ERROR = 0.03

#: Images in float32 are wrong by less than this part of a pixel, so a share ROUNDING² of the energy says nothing.
#: True lights leave up to 4e-13, measured, and how much differs from one processor to another.
ROUNDING = 1e-6

#: What is left of the weight of a block of saturated pixels: a target of nothing else still has a brightest side.
LEAST_BLOCK_WEIGHT = 1e-3


@dataclass(frozen=True)
class Effects:
    """Which parts of light transport a fit's model has."""

    shadows: bool = True
    interreflection: bool = True
    #: Direct light where pixels look, in the last steps of a fit and in its images; else at surfels' centres.
    at_pixels: bool = False
    #: How a fit's model encodes spots in spherical harmonics; None for their exact profile.
    spots: BandLimit | None = None


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
        exposures: (V,) float64 of the views, by which the target is divided already.
        exposure_free: whether these are only a guess, and are found together with the intensities.
        clip: (P, 1) float32 radiance at which the target is clipped, over `scale`; None where it is not.
        noise: (P, 3) float32 standard deviation of the target's rounding, over `scale`; None where there is none.
        differences: whether derivatives are taken by central differences instead of analytically.
        blocks: where set, P counts blocks of pixels instead of pixels; see `coarsest`.
    """

    views: PreparedViews
    target: Tensor
    scale: float
    effects: Effects
    at_pixels: bool = False
    exposures: Tensor | None = None
    exposure_free: bool = False
    clip: Tensor | None = None
    noise: Tensor | None = None
    differences: bool = False
    blocks: BlockModel | None = None

    @classmethod
    def create(
        cls,
        views: PreparedViews,
        stacked: Tensor,
        effects: Effects | None = None,
        capture: ImageCapture | None = None,
    ) -> LightProblem:
        """The problem for images stacked by `PreparedViews.stack_images`, (all pixels, 3)."""
        capture = capture or ImageCapture()
        target = stacked[views.pixels].double()
        scale = max(0.0, float(average(target)))
        normalised = target / scale if scale > 0.0 else target
        if not bool(torch.isfinite(normalised).all()):
            scale, normalised = 0.0, torch.zeros_like(target)
        problem = cls(views, normalised.float(), scale, effects or Effects())
        free = capture.exposure_free and len(views.views) > 1
        problem = replace(problem, exposures=torch.ones(len(views.views)).double(), exposure_free=free)
        if capture.clip is None or scale == 0.0:
            return problem
        clip = torch.full_like(problem.target[:, :1], capture.clip / scale)
        return replace(problem, clip=clip, noise=rounding_noise(target / scale, capture.clip / scale).float())

    @property
    def black(self) -> bool:
        """Whether there is nothing to explain."""
        return self.scale == 0.0

    def evaluate(self, emitter: Emitter) -> Tensor:
        """(P, 3, 1 + d) float32 image of a unit light, and its derivatives towards the emitter's natural parameters.

        Derivatives are per scene unit and rad; see `Emitter`.
        """
        if self.differences:
            size = self.views.frozen.size
            return central_differences(lambda other: self._evaluate(other)[:, :, 0], emitter, size)
        return self._evaluate(emitter)

    def renderings(self, emitters: Sequence[Emitter]) -> int:
        """How many images `evaluate` makes of these."""
        return sum(1 + 2 * emitter.parameters if self.differences else 1 for emitter in emitters)

    def _evaluate(self, emitter: Emitter) -> Tensor:
        """`evaluate` with analytic derivatives."""
        frozen = self.views.frozen
        sent = emitted_share(emitter, frozen.bvh.surfels.centers, self.effects.spots)
        share, slope = self._shares(emitter.position, sent)
        lightings = self._on_surfels(emitter, sent, share, slope)
        if self.at_pixels:
            return self._seen_at_pixels(emitter, share, slope, lightings)
        if self.blocks is not None:
            return self.blocks.seen(frozen, lightings)
        if frozen.gloss is not None:
            return seen_with_gloss(self.views, emitter.position, lightings, self.effects.interreflection)
        radiance = frozen.radiance(lightings, self.effects.interreflection)
        return _seen(self.views.operator, radiance)

    def _shares(self, position: Tensor, sent: Share | None) -> tuple[Tensor, Tensor]:
        """Share (N,) of a light that reaches each surfel that it shines on, and its derivative (N, 3)."""
        bvh, shadows = self.views.frozen.bvh, self.effects.shadows
        if sent is None or not shadows:
            return surfel_shares(bvh, position, shadows)
        return lit_shares(bvh, position, sent.value.abs() > LEAST_LIT)

    def _on_surfels(self, emitter: Emitter, sent: Share | None, share: Tensor, slope: Tensor) -> Tensor:
        """(N, 1 + d) irradiance of a unit light on surfels and its derivatives, at their centres."""
        factor, factor_slope = unit_irradiance(self.views.frozen.bvh, emitter.position[None], shadows=False)
        factor, factor_slope = factor[0], factor_slope[0]
        slope = factor_slope * share[:, None] + factor[:, None] * slope
        return shared(torch.cat([(factor * share)[:, None], slope], dim=1), sent, emitter)

    def _seen_at_pixels(self, emitter: Emitter, share: Tensor, slope: Tensor, lightings: Tensor) -> Tensor:
        """`evaluate` with direct light where pixels look; what bounces still starts from surfels' centres."""
        frozen, position = self.views.frozen, emitter.position
        images = [direct.image(position, share, slope) for direct in self.views.pixel_direct]
        for index, highlights in enumerate(self.views.highlights):
            images[index] = images[index] + highlights.image(position, share, slope)
        columns = torch.cat(images)[self.views.pixels]
        if emitter.axis is not None:
            columns = shared(columns, emitted_share(emitter, self.views.points, self.effects.spots), emitter)
        if not self.effects.interreflection:
            return columns
        if frozen.gloss is not None:
            return columns + seen_with_gloss(self.views, position, lightings, True, bounced_only=True)
        bounced = frozen.radiance(lightings) - frozen.radiance(lightings, indirect=False)
        return columns + _seen(self.views.operator, bounced)

    def sharpest(self) -> LightProblem:
        """The same problem with direct light where pixels look, if the views were made ready for that."""
        return replace(self, at_pixels=bool(self.views.pixel_direct))

    def coarsest(self, blocks: BlockModel | None) -> LightProblem:
        """The same problem for averages over blocks of pixels, if all that it asks of pixels can be asked of blocks.

        Blocks see neither lobes of gloss nor which of their pixels are saturated.
        """
        if blocks is None or self.clip is not None or self.views.frozen.gloss is not None:
            return self
        return replace(self, target=blocks.average @ self.target, blocks=blocks, at_pixels=False, noise=None)

    @property
    def view_of(self) -> Tensor:
        """(P,) int64 view of each pixel."""
        return self.views.view_of if self.blocks is None else self.blocks.view_of

    @property
    def pixels_each(self) -> Tensor:
        """(P,) float64 how many pixels each residual stands for."""
        return torch.ones(len(self.target)).double() if self.blocks is None else self.blocks.counts.cpu()

    def moments(self, columns: Sequence[Tensor], weights: Tensor) -> Moments | ExposedMoments:
        """Weighted moments of the lights' evaluations against the target."""
        if not self.exposure_free:
            return moments(columns, self.target, weights)
        bounds = self.views.bounds if self.blocks is None else self.blocks.bounds
        return moments_by_view(columns, self.target, weights, bounds)

    def residual(self, columns: Sequence[Tensor], intensity: Tensor) -> Tensor:
        """(P, 3) float32 target − image at intensities (L, 3), both over `scale`.

        The image has its best exposures where these are free. Where the target is clipped, and the image as bright as
        that or brighter, nothing is known to be wrong: the residual is 0.
        """
        image = torch.zeros_like(self.target)
        for light, strength in zip(columns, intensity, strict=True):
            image = image + light[:, :, 0] * strength.to(light)
        if self.exposure_free:
            weights, view_of = self.unclipped(self.relative_weights().square()), self.view_of
            factors = best_factors(self.target, image, weights, view_of, len(self.views.views))
            image = image * factors.to(image)[view_of][:, None]
        residual = self.target - image
        return residual if self.clip is None else torch.where(self.saturated & (residual <= 0.0), 0.0, residual)

    @cached_property
    def saturated(self) -> Tensor:
        """(P, 3) bool: values that tell only that the radiance is at least so high."""
        if self.clip is None:
            return torch.zeros_like(self.target, dtype=torch.bool)
        return self.target >= SATURATED * self.clip

    def unclipped(self, weights: Tensor) -> Tensor:
        """Weights (P, 1) or (P, 3) that leave out values of which it is not known whether they are met."""
        return weights if self.clip is None else weights * ~self.saturated

    def with_exposures(self, exposures: Tensor) -> LightProblem:
        """The same problem, the target divided by (V,) exposures on top of those that it was divided by already."""
        factors = exposures.to(self.target)[self.view_of][:, None]
        clip, noise = (None if part is None else part / factors for part in (self.clip, self.noise))
        return replace(self, target=self.target / factors, exposures=self.exposures * exposures, clip=clip, noise=noise)

    def relative_weights(self) -> Tensor:
        """(P, 1) weights that make errors relative to the pixel's own brightness, where rounding is not larger."""
        size = self.target.mean(dim=1, keepdim=True).clamp(min=0.0) + RELATIVE_FLOOR
        if self.noise is not None:
            size = (size.square() + (self.noise.mean(dim=1, keepdim=True) / RELATIVE_ERROR).square()).sqrt()
        if self.blocks is None:
            return 1.0 / size
        # A block counts as much as its pixels do together.
        counts = self.blocks.counts.to(size)
        return (counts / average(counts)).sqrt()[:, None] / size

    def block_weights(self, target: Tensor, counts: Tensor, blocks: SparseOperator) -> Tensor:
        """(B, 3) squared relative weights of block averages (B, 3) over `counts` (B,) pixels each.

        Args:
            blocks: (B, P) the averages. Those of which more than a quarter is saturated hardly count.
        """
        relative = 1.0 / (target.mean(dim=1).clamp(min=0.0) + RELATIVE_FLOOR)
        weights = (counts * relative.square())[:, None].expand(target.shape)
        if self.clip is None:
            return weights
        share = blocks @ self.saturated.float()
        return weights * (1.0 - 4.0 * share).clamp(min=LEAST_BLOCK_WEIGHT).to(weights)

    def unexplained(self, columns: Sequence[Tensor], intensity: Tensor) -> float:
        """Σ (target − image)² / Σ target², the loss that is reported: 0 is a perfect fit, 1 a black image."""
        energy = float(total(self.target.double().square()))
        return float(total(self.residual(columns, intensity).double().square())) / energy if energy > 0.0 else 0.0


def _seen(operator: SparseOperator, radiance: Tensor) -> Tensor:
    """(P, 3, K) images of radiance (N, 3, K)."""
    channels, lightings = radiance.shape[1:]
    return (operator @ radiance.reshape(len(radiance), channels * lightings)).reshape(-1, channels, lightings)
