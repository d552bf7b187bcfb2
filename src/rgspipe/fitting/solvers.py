"""Ways from images to lights: each an object of its options, which fits any number of targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol, runtime_checkable

from torch import Tensor

from rgspipe.fitting.baselines.paper_adam import fit_paper_adam
from rgspipe.fitting.baselines.paper_adam_start import LightPrior
from rgspipe.fitting.course import effort_of
from rgspipe.fitting.findings import ExposureUnknown
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.differences import DifferenceModel, by_differences
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import AdamOptions, SearchOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search_lm import polished
from rgspipe.fitting.searched import Searched, searched
from rgspipe.fitting.target_views import TargetViews
from rgspipe.scene import PointLight


@runtime_checkable
class Solver(Protocol):
    """A way from images to lights."""

    def fit(self, views: TargetViews, images: Tensor, capture: ImageCapture) -> FitResult:
        """The lights of images (all pixels of all views, 3)."""
        ...


@dataclass(frozen=True)
class Search(SearchOptions):
    """Candidates in closed form, then Levenberg-Marquardt on all lights, intensities in closed form."""

    derivatives: Literal["analytic", "differences"] = "analytic"
    """of images towards the lights, or central differences in their place, for comparison"""

    def fit(self, views: TargetViews, images: Tensor, capture: ImageCapture) -> FitResult:
        """The lights of images (all pixels of all views, 3)."""
        with Meter.shown(effort_of(views.lights)) as meter:
            return self.polished(self.searched(views, images, capture, meter), views, images, capture, meter)

    def searched(self, views: TargetViews, images: Tensor, capture: ImageCapture, meter: Meter) -> Searched | None:
        """What blocks of pixels tell of the lights; None if no light explains any of the images."""
        problem, blocks = self._problem(views, images, capture), views.blocks
        if self.derivatives == "differences":
            blocks = DifferenceModel(blocks, views.prepared.frozen.size)
        return None if problem.black else searched(problem, views.coarse(self.aimed), self, views.lights, blocks, meter)

    def polished(
        self, found: Searched | None, views: TargetViews, images: Tensor, capture: ImageCapture, meter: Meter
    ) -> FitResult:
        """The lights, by all pixels of `views`: those that were searched, or more of the same images."""
        result = polished(self._problem(views, images, capture), found, self, views.lights, meter)
        if capture.exposure_free and len(views.prepared.views) == 1:
            return replace(result, findings=(*result.findings, ExposureUnknown()))
        return result

    def _problem(self, views: TargetViews, images: Tensor, capture: ImageCapture) -> LightProblem:
        problem = views.problem(images, capture, self.loss)
        return by_differences(problem) if self.derivatives == "differences" else problem


@dataclass(frozen=True)
class PaperAdam(AdamOptions):
    """The published method: Adam from one start, for lights of known kind, number and shape."""

    training_lights: Sequence[PointLight] = ()
    """lights of known images, near which a start is drawn; without them it is drawn on a sphere"""
    seed: int = 0
    """of the start"""

    def fit(self, views: TargetViews, images: Tensor, capture: ImageCapture) -> FitResult:
        """The lights of images (all pixels of all views, 3).

        Raises:
            ValueError: exposures are free, images are clipped or have a base, there may be ambient light, lights have
                an extent, or their kind, number or shape are not known.
        """
        if capture != ImageCapture():
            raise ValueError("PaperAdam takes images as radiance with known exposures, lit by lamps alone: use Search")
        if views.lights.ambient:
            raise ValueError("PaperAdam knows no light from all around: use Search")
        if views.lights.extended or not views.lights.kinds[-1].in_one_point:
            raise ValueError("PaperAdam moves lights in one point: use Search")
        problem, prior = LightProblem.create(views.prepared, images, views.effects), LightPrior.of(self.training_lights)
        return fit_paper_adam(problem, images, self, prior, self.seed, views.lights)
