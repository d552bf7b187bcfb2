"""Fit targets that are made of single lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.datasets.classes import LIGHT_CLASSES, LightClass
from rgspipe.errors import InputError
from rgspipe.fitting.options import MOST_LIGHTS
from rgspipe.names import PoolKind, SpotProfile
from rgspipe.options import Options, option


def check_order(name: str, ends: tuple[float, float] | None) -> None:
    """Refuse a range that ends before it begins.

    Raises:
        InputError: says so.
    """
    if ends is not None and ends[0] > ends[1]:
        expected, found = "the least value, then the largest", f"[{ends[0]:g},{ends[1]:g}]"
        raise InputError(name, expected=expected, found=found, remedy="Put them in order.")


@dataclass(frozen=True)
class TargetSpotConfig(Options):
    """The spots of generated targets; each range is drawn from uniformly."""

    profile: SpotProfile = "smoothstep"
    """how intensity falls with the angle from the axis"""
    cone_angle: tuple[float, float] = option((25.0, 25.0), low=1, high=89)
    """least and largest half-angle of the cone, degrees"""
    falloff: tuple[float, float] = option((0.15, 0.15), low=0.001, high=89)
    """least and largest width of the rim, as light.spot.falloff"""

    def check(self) -> None:
        """Refuse ranges that end before they begin."""
        for name in ("cone_angle", "falloff"):
            check_order(name, getattr(self, name))


@dataclass(frozen=True)
class TargetsConfig(Options):
    """Generated fit targets: sums of single lights, each of which is rendered once."""

    kind: Literal[PoolKind, "mixed"] = "points"
    """lights of a target: points, spots, of each at least one, spheres, panels, suns, LEDs, measured luminaires, or the
    headlights of a car that drives around the bend of scene=corner"""
    number: int = option(40, low=1, high=100000)
    """targets; a drive has `frames`"""
    count: tuple[int, int] = option((1, 1), low=1, high=MOST_LIGHTS)
    """fewest and most lights of a target"""
    classes: tuple[LightClass, ...] = LIGHT_CLASSES
    """where lights are, in turn; classes that the scene has none of are left out"""
    weakest: float = option(0.15, low=0, high=0.5)
    """least share of a light in the mean radiance of its target"""
    separation: float = option(0.1, low=0, high=10)
    """least distance between the lights of a target, scene units; of suns rad"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of which lights make up a target, and of their intensities"""
    pool: int = option(60, low=1, high=100000)
    """lights of each type that are rendered, one at a time"""
    pool_seed: int = option(0, low=0, high=2**31 - 1)
    """draws of the lights' places, axes and cones"""
    frames: int = option(24, low=1, high=100000)
    """targets of a drive, equally far apart on the way"""
    views: int = option(3, low=1, high=8)
    """fixed cameras that see each target"""
    cameras: tuple[float, ...] | None = option(None, low=-1e6, high=1e6)
    """cameras in the place of the scene's own: of each the place and a point that it looks at, scene units, and degrees
    across, [x,y,z,x,y,z,degrees,…]"""
    resolution: int | None = option(None, low=8, high=8192)
    """image width and height, pixels; by default the dataset's"""
    samples: int | None = option(None, low=1, high=10**6)
    """paths per pixel of a single light; by default the dataset's"""
    max_bounces: int | None = option(None, low=0, high=1024)
    """bounces of a path; by default the dataset's. Around a corner 12 lose 2 to 4 %"""
    spot: TargetSpotConfig = TargetSpotConfig()
    radius: tuple[float, float] = option((0.02, 0.08), low=0, high=1)
    """least and largest radius of spheres, scene units"""
    side: tuple[float, float] = option((0.1, 0.3), low=0.001, high=10)
    """least and largest side of panels, scene units"""
    exponent: tuple[float, float] = option((1.0, 16.0), low=0, high=1000)
    """least and largest exponent of LEDs"""
    luminaires: str | None = None
    """of profiles: a measured luminaire (.ies or .ldt), or a folder of them, which the pool's lights take in turn"""
    mounted: tuple[float, float] | None = option(None, low=0.0001, high=1)
    """least and largest distance between a lamp and the surface that it hangs on, scene units; null for lamps that hang
    free. Panels always lie on a surface: without this, 0.002 before it"""

    def check(self) -> None:
        """Refuse ranges that end before they begin."""
        for name in ("radius", "side", "exponent", "mounted"):
            check_order(name, getattr(self, name))
