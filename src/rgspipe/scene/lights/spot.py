"""Spots: one-sided lights with a cone and a rim."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import torch
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.names import SpotProfile
from rgspipe.scene.lights.axial import AxialLight
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.lights.shape_coordinates import Between, Positive
from rgspipe.scene.lights.shape_number import ShapeNumber
from rgspipe.scene.lights.spot_profiles import PROFILES, Profile, softened

#: A free cone stays between these half-angles, and a free Gaussian falloff within its own limits, rad.
CONE = Between(math.radians(1.0), math.radians(89.0))
FALLOFF = Positive(math.radians(0.1), math.radians(60.0))

#: Cone angles that a search tries where the cone is free, rad.
CONES = tuple(math.radians(angle) for angle in (15.0, 25.0, 40.0))


@dataclass(frozen=True)
class SpotLight(AxialLight):
    """A one-sided spot light.

    Attributes:
        profile: how intensity falls with the angle from the axis; see `spot_profiles`. `gaussian`: 1 inside
            `cone_angle`, a Gaussian outside; `smoothstep`: Blender's; `linear`: Mitsuba's.
        cone_angle: half-angle, rad.
        falloff: of `gaussian` the standard deviation of the rim [rad], of `smoothstep` the blend in [0, 1], of
            `linear` the beam angle [rad].

    Raises:
        InputError: the profile has another name, or an angle is out of range.
    """

    kind: ClassVar[str] = "spot"
    ranges: ClassVar = {
        "cone_angle": ("a half-angle from 0 to π radians (math.radians makes them of degrees)", 0.0, math.pi),
        "falloff": ("an angle, or a blend, of 0 or more", 0.0, math.inf),
    }

    profile: SpotProfile
    cone_angle: float
    falloff: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if str(self.profile) not in PROFILES:
            expected, found = f"one of {', '.join(PROFILES)}", f"{self.profile!r:.80}"
            raise InputError("profile", expected=expected, found=found, remedy="gaussian is usual.")

    @classmethod
    def shaped(cls, profile: SpotProfile = "smoothstep", cone_angle: float = CONES[1], falloff: float = 0.15) -> Self:
        return cls([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0], profile, cone_angle, falloff)

    @property
    def shape(self) -> tuple[ShapeNumber, ...]:
        profile = self._profile
        moves = FALLOFF if self.profile == "gaussian" else None
        widest = profile.largest_falloff(self.cone_angle)
        rim = ShapeNumber("falloff", profile.falloff_key, profile.falloff_unit, moves, widest, decimals=None)
        return ShapeNumber("cone_angle", "cone_angle", "°", CONE), rim

    @property
    def rim(self) -> float:
        cone, falloff = (torch.as_tensor(x, dtype=torch.float64) for x in (self.cone_angle, self.falloff))
        return float(self._profile.half_and_width(cone, falloff)[1])

    def profile_at(self, angle: Tensor, numbers: Mapping[str, Tensor], softness: float = 0.0) -> tuple[Tensor, Tensor]:
        profile, *rim = softened(self._profile, numbers["cone_angle"], numbers["falloff"], softness)
        return profile(angle, *rim)

    def kinks(self, softness: float = 0.0) -> list[float]:
        rim = (torch.as_tensor(x, dtype=torch.float64) for x in (self.cone_angle, self.falloff))
        profile, cone, falloff = softened(self._profile, *rim, softness)
        return [min(max(angle, 0.0), math.pi) for angle in profile.kinks(float(cone), float(falloff))]

    def changed(self, name: str, value: Any) -> Self:
        if name != "cone_angle":
            return super().changed(name, value)
        falloff = self._profile.falloff_with(self.cone_angle, self.falloff, value)
        return replace(self, cone_angle=value, falloff=falloff)

    def tied_slopes(self, by: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        # A falloff that follows the cone is proportional to it.
        tied = self._profile.falloff_with(1.0, 1.0, 2.0) != 1.0 and self.cone_angle > 0.0
        if not tied or "falloff" not in by:
            return by
        return {**by, "cone_angle": by["cone_angle"] + by["falloff"] * (self.falloff / self.cone_angle)}

    def variants(self) -> tuple[Self, ...]:
        return tuple(self.changed("cone_angle", cone) for cone in CONES)

    def file_fields(self) -> dict[str, object]:
        return {"profile": self.profile} | super().file_fields()

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        direction, profile = reader.direction("direction"), reader.choice("profile", tuple(PROFILES))
        numbers = (reader.number(key) for key in ("cone_angle", PROFILES[profile].falloff_key))
        return cls(position, intensity, direction, profile, *numbers)

    def emission(self, maths: Any, cosine: Any) -> Any:
        if self.rim == 0.0:
            # Profiles divide by the width of their rim.
            return maths.subtract(1.0, maths.greater_than(maths.arccosine(cosine), self.cone_angle))
        return self._profile.emission(maths, cosine, self.cone_angle, self.falloff)

    @property
    def _profile(self) -> Profile:
        return PROFILES[self.profile]
