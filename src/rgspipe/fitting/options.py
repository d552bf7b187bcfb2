"""What steers the fits. Nothing here loads torch, so that the command line can show it at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.options import Options, option

#: Ways from images to lights; `finite_differences` is search_lm with derivatives by central differences.
Method = Literal["search_lm", "paper_adam", "finite_differences"]

#: Where the number of lights is not known, at most so many are tried.
MOST_LIGHTS = 8


@dataclass(frozen=True)
class SearchOptions(Options):
    """How `search_lm` searches: a dictionary with closed-form intensity, then Levenberg-Marquardt."""

    starts: int = option(4, low=1, high=4096)
    """best candidates that are refined"""
    iterations: int = option(30, low=1, high=10000)
    """most Levenberg-Marquardt steps of the final refinement"""


@dataclass(frozen=True)
class StartOptions(Options):
    """Where the published method starts; without training lights always on a sphere."""

    init: Literal["dataset", "sphere"] = "dataset"
    """where positions are drawn from: the training lights' mean and spread, or a sphere"""
    random_intensity: bool = False
    """draw the first intensity too: e^u times its mean, u uniform in ±1"""
    aim: Literal["center", "random"] = "center"
    """where spots point at first: to the scene's middle, or anywhere"""


@dataclass(frozen=True)
class AdamOptions(StartOptions):
    """The published method, with its defaults."""

    epochs: int = option(25, low=1, high=100000)
    """epochs"""
    steps: int = option(50, low=1, high=100000)
    """steps of an epoch"""
    position_rate: float = option(0.01, low=0, high=100)
    """learning rate of the positions"""
    intensity_rate: float = option(0.05, low=0, high=100)
    """learning rate of the log-intensities"""
    axis_rate: float = option(0.005, low=0, high=100)
    """learning rate of spots' axes"""
    ssim_weight: float = option(0.2, low=0, high=1)
    """λ, the share of structural similarity in the loss"""
    patience: int | None = option(None, low=1, high=100000)
    """stop after so many epochs without a lower loss; by default never"""


@dataclass(frozen=True)
class TrackOptions(Options):
    """How moving lights are followed from frame to frame."""

    lost: float = option(2.0, low=1, high=1000)
    """a frame that is so many times worse explained than those next to it is searched anew"""
    iterations: int = option(15, low=1, high=10000)
    """most Levenberg-Marquardt steps of a frame"""
    searches: int = option(6, low=1, high=10000)
    """most frames that are searched from nothing, those of the beginning and lost ones together"""
    together: bool = False
    """the lights are carried by one thing, such as a car: they move and turn together"""
