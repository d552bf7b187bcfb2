"""From the configuration of a spot's profile, in degrees, to its shape."""

from __future__ import annotations

import math

from rgspipe.config import SpotConfig
from rgspipe.errors import InputError
from rgspipe.renderer.spot import SpotShape


def spot_shape(spot: SpotConfig, key: str) -> SpotShape:
    """The shape of spots that the section `key` of the configuration describes.

    Raises:
        InputError: the rim does not fit the cone.
    """
    largest = {"smoothstep": 1.0, "gaussian": 89.0, "linear": spot.cone_angle}[spot.profile]
    if spot.falloff > largest:
        raise InputError(
            f"{key}.falloff",
            expected=f"at most {largest:g} for {spot.profile} and a cone of {spot.cone_angle:g} degrees",
            found=f"{spot.falloff:g}",
            remedy="Give a narrower rim.",
        )
    rim = spot.falloff if spot.profile == "smoothstep" else math.radians(spot.falloff)
    return SpotShape(spot.profile, math.radians(spot.cone_angle), rim)
