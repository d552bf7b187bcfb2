"""Light sources in scene units and W/sr."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from torch import Tensor

SpotProfile = Literal["gaussian", "smoothstep", "linear"]

#: Power [W] of a Blender/Cycles point light over its radiant intensity [W/sr].
WATTS_PER_INTENSITY = 4.0 * math.pi


@dataclass(frozen=True)
class PointLight:
    """An isotropic point light.

    Attributes:
        position: (3,) scene units.
        intensity: (3,) RGB radiant intensity, W/sr.
    """

    position: Tensor
    intensity: Tensor


@dataclass(frozen=True)
class SpotLight:
    """A one-sided spot light, rotationally symmetric around its axis.

    Attributes:
        position: (3,) scene units.
        intensity: (3,) RGB radiant intensity on the axis, W/sr.
        direction: (3,) unit vector along the axis, away from the light.
        profile: how intensity falls with the angle θ from the axis. `gaussian`: 1 inside `cone_angle`,
            exp(−(θ−cone_angle)²/(2·falloff²)) outside; `smoothstep`: Blender's, `falloff` is its blend
            in [0, 1]; `linear`: Mitsuba's, `falloff` is its beam angle [rad].
        cone_angle: half-angle, rad.
        falloff: see `profile`.
    """

    position: Tensor
    intensity: Tensor
    direction: Tensor
    profile: SpotProfile
    cone_angle: float
    falloff: float


Light = PointLight | SpotLight
LightRig = tuple[Light, ...]
