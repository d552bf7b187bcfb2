"""From images of a frozen scene to the lights that made them."""

from rgspipe.fitting.baselines.paper_adam import AdamOptions
from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.fit import FitViews, fit_lights, prepare_fit, render_light, render_rig
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.problem import Effects
from rgspipe.fitting.result import FitResult, Step
from rgspipe.fitting.search_lm import SearchOptions
from rgspipe.fitting.spec import LightSpec

__all__ = [
    "AdamOptions",
    "Effects",
    "FitResult",
    "FitStatus",
    "FitViews",
    "ImageCapture",
    "LightSpec",
    "SearchOptions",
    "Step",
    "fit_lights",
    "prepare_fit",
    "render_light",
    "render_rig",
]
