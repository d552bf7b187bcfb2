"""What is compared with what."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from rgspipe.config.scene import Modelled
from rgspipe.fitting.options import Method
from rgspipe.options import Options, option

#: What a study of lights is about.
LightStudy = Literal["views", "robustness", "classes", "kinds", "regions", "adam"]


@dataclass(frozen=True)
class EvaluateConfig(Options):
    """How estimates are compared with the truth."""

    success: float = option(0.01, low=0, high=1)
    """largest position error of a success, fraction of the scene's size"""


@dataclass(frozen=True)
class StudyConfig(Options):
    """What becomes of a trained scene when its capture gets worse."""

    cases: tuple[str, ...] = ("clean",)
    """captures: `clean`, or overrides such as capture.depth_noise=0.01, several joined by spaces, and `NAME: ` before
    them where wanted"""
    scenes: tuple[Modelled, ...] = ()
    """scenes that are compared; by default the one that is configured"""
    limit: int | None = option(6, low=1, high=100000)
    """lights of each class that are recovered in each case"""


@dataclass(frozen=True)
class LightStudyConfig(Options):
    """What recovered lights are like over numbers of views, bad images and models, or where the lights are."""

    kind: LightStudy = "robustness"
    """the figure: errors against the number of views; cases of errors in images and model; classes of lights; kinds of
    lights; how often 95 % regions hold the truth; or the paper's method beside ours"""
    cases: tuple[str, ...] = ("clean",)
    """what is compared: `clean`, or overrides such as target_capture.noise=0.03, several joined by spaces, and `NAME: `
    before them where wanted"""
    scenes: tuple[Modelled, ...] = ()
    """scenes that are compared; by default the one that is configured"""
    views: tuple[int, ...] = option((1,), low=1, high=1000)
    """numbers of views"""
    methods: tuple[Method, ...] = ("search_lm",)
    """methods"""
    paper_adam_limit: int | None = option(1, low=1, high=100000)
    """targets of each class that paper_adam is run on"""
    paper_adam_views: tuple[int, ...] | None = option(None, low=1, high=1000)
    """numbers of views that paper_adam, which takes minutes a target, is run on; all if null"""


@dataclass(frozen=True)
class ConvergenceConfig(Options):
    """How methods get from their start to their answer."""

    methods: tuple[Method, ...] = get_args(Method)
    """methods that are compared"""
    limit: int = option(1, low=1, high=100000)
    """targets of each class, where fit.limit does not say"""
