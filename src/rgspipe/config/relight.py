"""A frozen scene in any lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.config.light import SpotConfig
from rgspipe.fitting.options import MOST_LIGHTS
from rgspipe.options import Options, option


@dataclass(frozen=True)
class SweepConfig(Options):
    """The spot of relight.sweep and its way."""

    frames: int = option(48, low=2, high=10000)
    """images of the way"""
    seconds: float = option(4.0, low=0.1, high=1000)
    """how long the video shows them, s"""
    position: tuple[float, float, float] | None = option(None, low=-1e6, high=1e6)
    """aim: place of the spot, scene units; by default under the middle of a ceiling, or above an object"""
    aims: tuple[float, float, float, float, float, float] | None = option(None, low=-1e6, high=1e6)
    """aim: points that the axis turns from and to, [x,y,z,x,y,z]; by default low at either side of the picture"""
    center: tuple[float, float, float] | None = option(None, low=-1e6, high=1e6)
    """orbit: what the spot is aimed at; by default the scene's middle"""
    radius: float | None = option(None, low=1e-6, high=1e6)
    """orbit: radius of the circle, scene units"""
    height: float | None = option(None, low=-1e6, high=1e6)
    """orbit: height of the circle over `center`, scene units"""
    intensity: tuple[float, float, float] = option((1.0, 1.0, 1.0), low=0, high=1e9)
    """of the spot on its axis, RGB, W/sr"""
    spot: SpotConfig = SpotConfig()


@dataclass(frozen=True)
class RelightConfig(Options):
    """A frozen scene in any lights."""

    lights: str | None = None
    """light file: points, spots or both; by default what `rigs` says"""
    rigs: Literal["random", "targets"] = "random"
    """lights where no file is given: drawn at random, or the true ones of fit targets, compared with their images"""
    count: int = option(3, low=1, high=MOST_LIGHTS)
    """lights of a random rig"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of a random rig"""
    counts: tuple[int, ...] = option((), low=1, high=MOST_LIGHTS)
    """numbers of lights: generated targets of each are compared side by side"""
    limit: int | None = option(8, low=1, high=100000)
    """most targets of each number of lights"""
    views: Literal["targets", "test", "train"] = "targets"
    """whose cameras: those of the fit targets, the held-out or the training views"""
    indices: tuple[int, ...] | None = option(None, low=0, high=100000)
    """these of the cameras; by default all, for a sweep the first"""
    resolution: int | None = option(None, low=8, high=8192)
    """width of the images, pixels; by default that of the cameras' own; not beside truth"""
    sweep: Literal["none", "aim", "orbit"] = "none"
    """a spot that turns at its place, or goes around the scene, as a strip and a video"""
    path: SweepConfig = SweepConfig()
