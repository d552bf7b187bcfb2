"""What is looked for, and how much of it is seen."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.errors import InputError
from rgspipe.fitting.options import MOST_LIGHTS
from rgspipe.names import LightType, Mount, SpotProfile
from rgspipe.options import Options, option


@dataclass(frozen=True)
class SpotConfig(Options):
    """The profile of unknown spots; with fit.shape=free its kind, and a rim to begin with."""

    profile: SpotProfile = "smoothstep"
    """how intensity falls with the angle from the axis: Blender's smoothstep, gaussian, or Mitsuba's linear"""
    cone_angle: float = option(25.0, low=1, high=89)
    """half-angle of the cone, degrees"""
    falloff: float = option(0.15, low=0, high=89)
    """width of the rim: of smoothstep Blender's blend (0 to 1); of gaussian the standard deviation, of linear the
    half-angle of the inner cone, degrees"""


@dataclass(frozen=True)
class LedConfig(Options):
    """The shape of unknown LEDs, whose intensity falls with a power of the cosine of the angle from their axis."""

    exponent: float = option(1.0, low=0, high=1000)
    """the power: ln ½ / ln cos of the half-angle; with fit.shape=free where to begin"""


@dataclass(frozen=True)
class SphereConfig(Options):
    """The size of unknown spheres."""

    radius: float = option(0.05, low=0, high=1e6)
    """scene units; with fit.shape=free it is found"""


@dataclass(frozen=True)
class PanelConfig(Options):
    """The size of unknown panels: rectangles that shine to one side."""

    width: float = option(0.2, low=0, high=1e6)
    """scene units; with fit.shape=free it is found, as are the next two"""
    height: float = option(0.2, low=0, high=1e6)
    """scene units"""
    turn: float = option(0.0, low=-180, high=180)
    """around the panel's axis, degrees; 0 has the width along x where the panel looks straight down"""


@dataclass(frozen=True)
class ProfileConfig(Options):
    """How unknown measured luminaires hang, of which `light.file` or `light.catalogue` names the table."""

    turn: float = option(0.0, low=-360, high=360)
    """around the axis, degrees, where to begin: it is found, unless the luminaire is the same all around"""


@dataclass(frozen=True)
class LightConfig(Options):
    """What is looked for."""

    type: LightType = "point"
    """type of the unknown lights"""
    count: int | None = option(1, low=1, high=MOST_LIGHTS)
    """how many unknown lights; null finds out"""
    mount: Mount = "free"
    """surface: they hang on surfaces of the scene; ceiling: on such as face down. Panels and LEDs shine away from it"""
    distance: float | None = option(None, low=0, high=1e6)
    """with a mount, how far they hang from it, scene units; by default it is found, and panels lie on it"""
    ambient: bool = False
    """whether there may be light besides, from all around through openings; its radiance is found, too"""
    spot: SpotConfig = SpotConfig()
    led: LedConfig = LedConfig()
    sphere: SphereConfig = SphereConfig()
    panel: PanelConfig = PanelConfig()
    profile: ProfileConfig = ProfileConfig()
    file: str | None = None
    """of light=profile: the measured luminaire, an IES (.ies) or EULUMDAT (.ldt) file; with none and no catalogue it
    shines as an even surface does. With light=auto lights may be it"""
    catalogue: str | None = None
    """of light=profile or auto: a folder of such files, of which the one is found that explains the image best"""


@dataclass(frozen=True)
class ViewsConfig(Options):
    """How much of a fit target is seen."""

    count: int = option(1, low=1, high=1000)
    """the first `count` cameras of the target"""
    indices: tuple[int, ...] | None = option(None, low=0, high=100000)
    """these cameras instead of the first ones"""

    def check(self) -> None:
        """Refuse a list without cameras."""
        if self.indices == ():
            raise InputError(
                "indices",
                expected="at least one camera's index",
                found="an empty list",
                remedy="Give indices such as [0,2], or leave it away and set views.count.",
            )
