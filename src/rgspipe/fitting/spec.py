"""What is known of the lights that a fit looks for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from rgspipe.renderer.spot import SpotShape

TYPES = ("point", "spot", "auto")

#: Where the number of lights is not known, at most so many are tried.
MOST_LIGHTS = 8

#: Cone angles that a search tries where the cone is free, rad.
CONES = tuple(math.radians(angle) for angle in (15.0, 25.0, 40.0))


@dataclass(frozen=True)
class LightSpec:
    """The lights that are looked for.

    Attributes:
        type: "point", "spot", or "auto": each light may be either, and is a spot where that is worth it.
        count: how many; None where it is not known (1 to MOST_LIGHTS).
        shape: the spots' profile; where the cone is free, only the kind of profile and a rim to begin with.
        cone_free: whether the cone angle, and the falloff of a Gaussian profile, are recovered, too.

    Raises:
        ValueError: an unknown type, or a count out of range.
    """

    type: str = "point"
    count: int | None = 1
    shape: SpotShape = field(default_factory=lambda: SpotShape("smoothstep", math.radians(25.0), 0.15))
    cone_free: bool = False

    def __post_init__(self) -> None:
        if self.type not in TYPES:
            raise ValueError(f"type must be one of {TYPES}, got {self.type!r}")
        if self.count is not None and not 1 <= self.count <= MOST_LIGHTS:
            raise ValueError(f"count must be None or 1 to {MOST_LIGHTS}, got {self.count}")

    @property
    def spots(self) -> bool:
        """Whether spots may be among the lights."""
        return self.type != "point"

    def shapes(self) -> tuple[SpotShape, ...]:
        """The profiles that a search tries."""
        return tuple(_with_cone(self.shape, cone) for cone in CONES) if self.cone_free else (self.shape,)


def _with_cone(shape: SpotShape, cone: float) -> SpotShape:
    """The profile with another cone angle; a linear one keeps the ratio of its two angles."""
    if shape.profile == "linear" and shape.cone_angle > 0.0:
        return replace(shape, cone_angle=cone, falloff=shape.falloff * cone / shape.cone_angle)
    return replace(shape, cone_angle=cone)
