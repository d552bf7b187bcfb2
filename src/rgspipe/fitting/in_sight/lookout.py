"""Images in which lamps may be in sight: what may be one, what a fit leaves out, and what it explains then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from rgspipe.fitting.findings import LampElsewhere, LampsLeftOut, PoorlyExplained
from rgspipe.fitting.in_sight.confirm import confirmed, located
from rgspipe.fitting.in_sight.lamp import LampInSight, Mask, left_out
from rgspipe.fitting.in_sight.places import places
from rgspipe.fitting.in_sight.sight import Numbers, Sight, needed_intensity
from rgspipe.fitting.in_sight.suspects import POSSIBLE, SURE, Bar, saturated, shaded, suspects, usual
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.target_views import TargetViews


@dataclass(frozen=True)
class Answer:
    """A fit, and the lamps whose pixels it was made without."""

    result: FitResult
    lamps: Sequence[LampInSight]


@dataclass(frozen=True)
class Lookout:
    """Images in which lamps may be in sight.

    Attributes:
        views: they are of.
        images: (all pixels, 3), stacked.
        capture: how they were taken.
        search: how lights are searched; what is no light to a search is no lamp either.
    """

    views: TargetViews
    images: Tensor
    capture: ImageCapture
    search: SearchOptions

    @property
    def size(self) -> float:
        """Longest side of the scene."""
        return self.views.prepared.frozen.size

    @property
    def near(self) -> float:
        """How far beside the rays through a lamp its light may stand, scene units."""
        return self.search.schedule.met * self.size

    @property
    def without_rival(self) -> float:
        """Lights that leave less than this part of what others leave of the same pixels are the better ones by far."""
        return 1.0 - self.search.bar.least_faint

    @property
    def sights(self) -> tuple[Sight, ...]:
        """What the pixels look at, one a view."""
        return self.views.sights

    @cached_property
    def greys(self) -> list[Numbers]:
        """(H, W) mean radiance of the channels, one a view."""
        return [_grey(image) for image in self.views.prepared.split(self.images)]

    def exposed(self, result: FitResult) -> list[Numbers]:
        """The greys, divided by the exposures that a fit found."""
        exposures = result.exposures or (1.0,) * len(self.greys)
        return [grey / exposure for grey, exposure in zip(self.greys, exposures, strict=True)]

    def suspects(self, bar: Bar) -> list[LampInSight]:
        """By the images alone."""
        shadings = [shaded(sight, grey) for sight, grey in zip(self.sights, self.greys, strict=True)]
        levels = [usual(sight, shading, bar.compact) for sight, shading in zip(self.sights, shadings, strict=True)]
        values = [
            np.minimum(shading, level)[sight.surface]
            for sight, shading, level in zip(self.sights, shadings, levels, strict=True)
        ]
        seen = np.concatenate(values)
        needed = needed_intensity(self.views.prepared, float(seen.mean()) if seen.size else 0.0)
        return suspects(self.sights, self.greys, self.search.bar.least_energy * needed, bar)

    def striking(self) -> list[LampInSight]:
        """What no reflection is; and, as a lamp in one view may be in the others, too, what may be one there."""
        sure = self.suspects(SURE)
        told = {lamp.view for lamp in sure}
        return [*sure, *(lamp for lamp in self.suspects(POSSIBLE) if lamp.view not in told)] if sure else []

    @cached_property
    def full(self) -> list[Mask]:
        """(H, W) bool a view, pixels that are saturated in all channels."""
        limits = (self.capture.saturated * self.capture.clips(len(self.greys))).tolist()
        images = self.views.prepared.split(self.images)
        return [(image >= limit).all(dim=2).cpu().numpy() for image, limit in zip(images, limits, strict=True)]

    @cached_property
    def saturated(self) -> list[LampInSight]:
        """What is saturated and compact."""
        return saturated(self.sights, self.greys, self.full)

    def doubtful(self, result: FitResult) -> list[LampInSight]:
        """What is saturated and no longer lit when a fit goes a little further without it."""
        if not result.lights or not self.saturated or not self.enough_without(self.saturated):
            return []
        views = self.without(self.saturated)
        refiner = Refiner.of(views.problem(self.images, self.capture).sharpest())
        rig = [Emitter.fitted(light, matrix) for light, matrix in zip(result.lights, result.covariance, strict=True)]
        state = refiner.refined(refiner.start(rig, PLAIN), PLAIN, self.search.schedule.steps)
        return self.confirmed(self.saturated, replace(result, lights=state.lights(refiner.problem)))

    def rendered(self, result: FitResult) -> list[Numbers]:
        """(H, W) mean radiance of the channels under a fit's lights, one a view, over its exposures."""
        exposures = result.exposures or (1.0,) * len(self.greys)
        return [_grey(image) / exposure for image, exposure in zip(self.explained(result), exposures, strict=True)]

    def explained(self, result: FitResult) -> list[Tensor]:
        """(H, W, 3) what a fit has for the images, one a view: its lights, and what is there besides them."""
        with torch.no_grad():
            shown = self.views.render(result.lights)
        exposures = result.exposures or (1.0,) * len(shown)
        exposed = [image * exposure for image, exposure in zip(shown, exposures, strict=True)]
        there = self.views.there_anyway(result, self.capture)
        return [image + other.to(image) for image, other in zip(exposed, there, strict=True)] if there else exposed

    def without(self, lamps: Sequence[LampInSight]) -> TargetViews:
        """The views less the lamps' pixels, looked at first from where the lamps may stand."""
        masks = left_out(lamps, [grey.shape for grey in self.greys])
        return self.views.without(masks, places(self.sights, lamps, self.search.certainty.doubtful * self.size))

    def enough_without(self, lamps: Sequence[LampInSight]) -> bool:
        """Whether most of the trusted pixels are left without the lamps'."""
        masks = left_out(lamps, [grey.shape for grey in self.greys])
        out = np.concatenate([mask.reshape(-1) for mask in masks])[self.views.prepared.pixels.cpu().numpy()]
        return float(out.mean()) < 0.5

    def sure(self, answer: Answer) -> bool:
        """Whether lights explain what was not left out, and stand where lamps are: pools of light are no lamps."""
        lamps = self.located(answer)
        return not poorly_explained(answer.result) and all(lamp.light is not None for lamp in lamps)

    def located(self, answer: Answer) -> list[LampInSight]:
        """The lamps of an answer with the numbers of its lights."""
        return located(self.sights, answer.lamps, answer.result.lights, self.near)

    def confirmed(self, lamps: Sequence[LampInSight], result: FitResult) -> list[LampInSight]:
        """Those that a fit without them does not light."""
        rendered = self.rendered(result)
        lights, faint = result.lights, self.search.bar.faint
        return confirmed(self.sights, self.exposed(result), lamps, lights, rendered, self.full, self.near, faint)

    def explains_more(self, result: FitResult, searched: TargetViews) -> bool:
        """Whether lights leave about as little of what was not `searched` as of what was."""
        pixels, own = self.views.prepared.pixels, searched.prepared.pixels
        more = pixels[~torch.isin(pixels, own)]
        if not len(more):
            return True
        explained = self.explained(result)
        return self.without_rival * self._left(explained, more) <= max(self._left(explained, own), ROUNDING**2)

    def far_better(self, answer: Answer, whole: FitResult) -> bool:
        """Whether a fit without lamps is to be preferred to one with them."""
        if not whole.lights:
            return True
        rest = self.without(answer.lamps).prepared.pixels
        left, left_by_whole = (self._left(self.explained(one), rest) for one in (answer.result, whole))
        return left < self.without_rival * left_by_whole

    def _left(self, explained: Sequence[Tensor], pixels: Tensor) -> float:
        """Share of the energy of `pixels` (P,) of all views that images do not explain."""
        image = torch.cat([image.reshape(-1, 3) for image in explained])[pixels].double()
        target = self.images[pixels].double()
        return float((target - image).square().sum() / target.square().sum())

    def told(self, answer: Answer) -> FitResult:
        """A fit with what is to be said of the lamps that it left out."""
        result = answer.result
        lamps = self.located(answer)
        masks = left_out(lamps, [grey.shape for grey in self.greys])
        count, views = int(sum(mask.sum() for mask in masks)), sum(bool(mask.any()) for mask in masks)
        elsewhere = [LampElsewhere(lamp.view, *lamp.place) for lamp in lamps if lamp.light is None and result.lights]
        findings = (*result.findings, *elsewhere, LampsLeftOut(len(lamps), count, views))
        return replace(result, findings=findings, lamps=tuple(lamps))


def poorly_explained(result: FitResult) -> bool:
    """Whether a fit says so."""
    return any(isinstance(finding, PoorlyExplained) for finding in result.findings)


def _grey(image: Tensor) -> Numbers:
    return image.detach().double().mean(dim=2).cpu().numpy()
