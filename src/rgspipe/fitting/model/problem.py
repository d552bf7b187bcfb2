"""The pixels that unknown lights have to explain, and what a light of any kind would show there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.capture import SATURATED, ImageCapture, rounding_noise
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.exposure import ExposedMoments, best_factors, moments_by_view
from rgspipe.fitting.model.known_images import KnownImage
from rgspipe.fitting.model.moments import Moments, moments
from rgspipe.fitting.model.views import LEAST_PIXELS, PreparedViews
from rgspipe.fitting.options import LossOptions
from rgspipe.machine.sums import average, total
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import ImageModel, SurfelModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.sparse import SparseOperator

#: Images in float32 are wrong by less than this part of a pixel, so a share ROUNDING² of the energy says nothing.
#: True lights leave up to 4e-13, measured, and how much differs from one processor to another.
ROUNDING = 1e-6

#: What is left of the weight of a block of saturated pixels: a target of nothing else still has a brightest side.
LEAST_BLOCK_WEIGHT = 1e-3


@dataclass(frozen=True)
class LightProblem:
    """Find the light whose image is the target.

    Attributes:
        views: the pixels that are used.
        model: how they see lights.
        target: (P, 3) float32 their radiance over `scale`, so that its mean is 1 and neither very bright nor
            very dim images leave the range of float32.
        scale: mean radiance of the target; 0 if it is black.
        sharp: how they see lights at best; None where that is how they do. See `sharpest`.
        exposures: (V,) float64 of the views, by which the target is divided already.
        exposure_free: whether these are only a guess, and are found together with the intensities.
        clip: (P, 1) or (P, 3) float32 radiance at which the target is clipped, over `scale`; None where it is not.
        saturated_from: the part of the clip from which on values are saturated.
        noise: (P, 3) float32 standard deviation of the target's rounding, over `scale`; None where there is none.
        loss: how much pixels count.
        known: images that are in the target anyway, of unknown strength.
    """

    views: PreparedViews
    model: ImageModel
    target: Tensor
    scale: float
    sharp: ImageModel | None = None
    exposures: Tensor | None = None
    exposure_free: bool = False
    clip: Tensor | None = None
    saturated_from: float = SATURATED
    noise: Tensor | None = None
    loss: LossOptions = field(default_factory=LossOptions)
    known: tuple[KnownImage, ...] = ()

    @classmethod
    def create(
        cls,
        views: PreparedViews,
        stacked: Tensor,
        effects: Effects | None = None,
        capture: ImageCapture | None = None,
        sharp: ImageModel | None = None,
        loss: LossOptions | None = None,
        ambient: Tensor | None = None,
    ) -> LightProblem:
        """The problem for images stacked by `PreparedViews.stack_images`, (all pixels, 3), seen through surfels.

        Args:
            ambient: (N, 3) radiance of the surfels under a void of radiance 1, if there may be light from there.
        """
        capture = capture or ImageCapture()
        taken = stacked[views.pixels].double()
        base = None if capture.base is None else views.stack_images(capture.base.images, "base")[views.pixels].double()
        target = taken if base is None or capture.base.scale_free else taken - base
        scale = max(0.0, float(average(target)))
        normalised = target / scale if scale > 0.0 else target
        if not bool(torch.isfinite(normalised).all()):
            scale, normalised = 0.0, torch.zeros_like(target)
        problem = cls(views, SurfelModel(views, effects or ALL_EFFECTS), normalised.float(), scale, sharp)
        free = capture.exposure_free and len(views.views) > 1
        exposures = torch.ones(len(views.views)).double()
        problem = replace(problem, exposures=exposures, exposure_free=free, loss=loss or LossOptions())
        if scale == 0.0:
            return problem
        if ambient is not None:
            problem = problem.with_known(KnownImage("ambient", views.operator @ ambient, scale, ambient))
        if base is not None and capture.base.scale_free:
            problem = problem.with_known(KnownImage("base", (base / scale).float(), 1.0))
        return problem if capture.clip is None else problem._clipped(capture, taken / scale, base)

    def _clipped(self, capture: ImageCapture, taken: Tensor, base: Tensor | None) -> LightProblem:
        """The problem of images that are clipped: of `taken` (P, 3), over the scale, less `base` (P, 3) or with it.

        Where the base is saturated nothing is known of the lights: what is left of the target there is at least 0.
        """
        clip = capture.clips(len(self.views.views)).to(taken.device)[self.model.view_of][:, None] / self.scale
        limit, noise = clip.to(self.target), rounding_noise(taken, clip)
        target = self.target
        if base is not None:
            base = base / self.scale
            unknown = base >= capture.saturated * clip
            below = 0.0 if capture.base.scale_free else base / capture.saturated
            limit = torch.where(unknown, 0.0, clip - below).float()
            target = torch.where(unknown, 0.0, target)
            noise = (noise.square() + rounding_noise(base, clip).square()).sqrt()
        return replace(self, target=target, clip=limit, saturated_from=capture.saturated, noise=noise.float())

    def with_known(self, image: KnownImage) -> LightProblem:
        """The problem of a target in which `image` may be besides, after those that may be there already."""
        return replace(self, known=(*self.known, image))

    @property
    def known_columns(self) -> tuple[Tensor, ...]:
        """(P, 3, 1) of each known image; they stand behind the lights' evaluations wherever these are put together."""
        return tuple(image.column for image in self.known)

    @property
    def black(self) -> bool:
        """Whether there is nothing to explain."""
        return self.scale == 0.0

    def evaluate(self, emitter: Emitter) -> Tensor:
        """(P, 3, 1 + d) float32 image of a unit light, and its derivatives towards the emitter's natural parameters.

        Derivatives are per scene unit and rad; see `Emitter`.
        """
        return self.model.columns(emitter)

    def renderings(self, emitters: Sequence[Emitter]) -> int:
        """How many images `evaluate` makes of these."""
        return sum(map(self.model.renderings, emitters))

    def sharpest(self) -> LightProblem:
        """The same problem with the sharpest images that there are."""
        return self if self.sharp is None else replace(self, model=self.sharp)

    def of_few_points(self) -> LightProblem:
        """The same problem with lights with an extent seen as few points: images on the way to an answer."""
        return replace(self, model=self.model.of_few_points())

    def of_few_pixels(self) -> LightProblem:
        """The same problem with a quarter of the pixels, where the model is one of pixels: likewise on the way."""
        views = self.views.thinned
        if not isinstance(self.model, PixelModel) or int(torch.tensor(views.bounds).diff().min()) < LEAST_PIXELS:
            return self
        chosen = self.views.few_pixels
        clip, noise = (None if part is None else part[chosen] for part in (self.clip, self.noise))
        known = tuple(image.at(chosen) for image in self.known)
        model, target = self.model.on(views), self.target[chosen]
        return replace(self, views=views, model=model, target=target, clip=clip, noise=noise, known=known, sharp=None)

    def coarsest(self, blocks: ImageModel | None) -> LightProblem:
        """The same problem for averages over blocks of pixels, if all that it asks of pixels can be asked of blocks.

        Blocks see neither lobes of gloss nor which of their pixels are saturated.
        """
        glossy = self.views.frozen.gloss is not None and self.model.effects.lobes
        if blocks is None or self.clip is not None or glossy:
            return self
        known = tuple(image.averaged(blocks.average) for image in self.known)
        return replace(self, target=blocks.average @ self.target, model=blocks, noise=None, known=known)

    def in_scene(self, frozen: FrozenScene) -> LightProblem:
        """The same problem for the same surfels with another solver of what bounces."""
        views = replace(self.views, frozen=frozen)
        return self if frozen is self.views.frozen else replace(self, views=views, model=self.model.on(views))

    def moments(self, columns: Sequence[Tensor], weights: Tensor) -> Moments | ExposedMoments:
        """Weighted moments of the lights' evaluations, and of known images behind them, against the target."""
        if not self.exposure_free:
            return moments(columns, self.target, weights)
        return moments_by_view(columns, self.target, weights, self.model.bounds)

    def residual(self, columns: Sequence[Tensor], intensity: Tensor) -> Tensor:
        """(P, 3) float32 target − image at intensities (L, 3), both over `scale`; L counts known images, too.

        The image has its best exposures where these are free. Where the target is clipped, and the image as bright as
        that or brighter, nothing is known to be wrong: the residual is 0.
        """
        image = torch.zeros_like(self.target)
        for light, strength in zip(columns, intensity, strict=True):
            image = image + light[:, :, 0] * strength.to(light)
        if self.exposure_free:
            weights, view_of = self.unclipped(self.relative_weights().square()), self.model.view_of
            factors = best_factors(self.target, image, weights, view_of, len(self.views.views))
            image = image * factors.to(image)[view_of][:, None]
        residual = self.target - image
        return residual if self.clip is None else torch.where(self.saturated & (residual <= 0.0), 0.0, residual)

    @cached_property
    def saturated(self) -> Tensor:
        """(P, 3) bool: values that tell only that the radiance is at least so high."""
        if self.clip is None:
            return torch.zeros_like(self.target, dtype=torch.bool)
        return self.target >= self.saturated_from * self.clip

    def unclipped(self, weights: Tensor) -> Tensor:
        """Weights (P, 1) or (P, 3) that leave out values of which it is not known whether they are met."""
        return weights if self.clip is None else weights * ~self.saturated

    def with_exposures(self, exposures: Tensor) -> LightProblem:
        """The same problem, the target divided by (V,) exposures on top of those that it was divided by already."""
        factors = exposures.to(self.target)[self.model.view_of][:, None]
        clip, noise = (None if part is None else part / factors for part in (self.clip, self.noise))
        return replace(self, target=self.target / factors, exposures=self.exposures * exposures, clip=clip, noise=noise)

    def relative_weights(self) -> Tensor:
        """(P, 1) weights that make errors relative to the pixel's own brightness, where rounding is not larger."""
        size = self.target.mean(dim=1, keepdim=True).clamp(min=0.0) + self.loss.floor
        if self.noise is not None:
            size = (size.square() + (self.noise.mean(dim=1, keepdim=True) / self.loss.error).square()).sqrt()
        # A block counts as much as its pixels do together.
        counts = self.model.counts.to(size)
        return (counts / average(counts)).sqrt()[:, None] / size

    def block_weights(self, target: Tensor, counts: Tensor, blocks: SparseOperator) -> Tensor:
        """(B, 3) squared relative weights of block averages (B, 3) over `counts` (B,) pixels each.

        Args:
            blocks: (B, P) the averages. Those of which more than a quarter is saturated hardly count.
        """
        relative = 1.0 / (target.mean(dim=1).clamp(min=0.0) + self.loss.floor)
        weights = (counts * relative.square())[:, None].expand(target.shape)
        if self.clip is None:
            return weights
        share = blocks @ self.saturated.float()
        return weights * (1.0 - 4.0 * share).clamp(min=LEAST_BLOCK_WEIGHT).to(weights)

    def unexplained(self, columns: Sequence[Tensor], intensity: Tensor) -> float:
        """Σ (target − image)² / Σ target², the loss that is reported: 0 is a perfect fit, 1 a black image."""
        energy = float(total(self.target.double().square()))
        return float(total(self.residual(columns, intensity).double().square())) / energy if energy > 0.0 else 0.0

    def unexplained_of_lights(self, columns: Sequence[Tensor], intensity: Tensor) -> float:
        """`unexplained` as a share of what the target has besides known images."""
        if not self.known:
            return self.unexplained(columns, intensity)
        count = len(self.known)
        lights = self.target.double()
        for image, strength in zip(self.known, intensity[-count:], strict=True):
            lights = lights - image.image.double() * strength.to(lights)
        energy = float(total(lights.square()))
        return float(total(self.residual(columns, intensity).double().square())) / energy if energy > 0.0 else 0.0
