"""Light sources in scene units and W/sr."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.scene.arrays import ArrayLike, as_tensor

SpotProfile = Literal["gaussian", "smoothstep", "linear"]

#: Power [W] of a Blender/Cycles point light over its radiant intensity [W/sr].
WATTS_PER_INTENSITY = 4.0 * math.pi


@dataclass(frozen=True)
class PointLight:
    """An isotropic point light. Lists and numpy arrays are taken for its tensors.

    Attributes:
        position: (3,) scene units.
        intensity: (3,) RGB radiant intensity, W/sr; a single number is grey.
    """

    position: Tensor
    intensity: Tensor

    def __post_init__(self) -> None:
        _settle(self, position=_vector(self.position, "position"), intensity=_colour(self.intensity))


@dataclass(frozen=True)
class SpotLight:
    """A one-sided spot light, rotationally symmetric around its axis. Lists and numpy arrays are taken for its tensors.

    Attributes:
        position: (3,) scene units.
        intensity: (3,) RGB radiant intensity on the axis, W/sr; a single number is grey.
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

    def __post_init__(self) -> None:
        _settle(
            self,
            position=_vector(self.position, "position"),
            intensity=_colour(self.intensity),
            direction=_vector(self.direction, "direction"),
        )


Light = PointLight | SpotLight
LightRig = tuple[Light, ...]


def as_rig(lights: Light | Sequence[Light]) -> LightRig:
    """A rig of several lights, or of one.

    Raises:
        InputError: something else.
    """
    rig = (lights,) if isinstance(lights, Light) else tuple(lights)
    for index, light in enumerate(rig):
        if not isinstance(light, Light):
            found = type(light).__name__
            raise InputError(
                f"lights[{index}]", expected="a light", found=found, remedy="Pass PointLight or SpotLight."
            )
    return rig


def _vector(value: ArrayLike, name: str) -> Tensor:
    return as_tensor(value, name, (3,))


def _colour(value: ArrayLike) -> Tensor:
    """(3,) RGB; one number stands for all three."""
    if np.ndim(value) == 0:
        return as_tensor(value, "intensity", ()).expand(3)
    return as_tensor(value, "intensity", (3,))


def _settle(light: PointLight | SpotLight, **tensors: Tensor) -> None:
    """Put tensors in the place of what a light was given."""
    for name, tensor in tensors.items():
        object.__setattr__(light, name, tensor)
