"""From what the configuration says of a kind of light, angles in degrees, to its shape."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

from rgspipe.errors import InputError
from rgspipe.scene.lights import KINDS, Light


def light_shape(kind: str, section: Any, key: str) -> Light:
    """A light of `kind` with the shape that the section `key` of the configuration describes.

    Raises:
        InputError: a number does not fit the others.
    """
    given = asdict(section)
    light = KINDS[kind].shaped(**{name: value for name, value in given.items() if isinstance(value, str)})
    light = replace(light, **{number.name: number.natural(given[number.name]) for number in light.shape})
    for number in light.shape:
        # The limit, but for the rounding of its way through radians.
        if getattr(light, number.name) > number.largest * (1.0 + 1e-12):
            others = ", ".join(f"{name}={value}" for name, value in given.items() if name != number.name)
            raise InputError(
                f"{key}.{number.name}",
                expected=f"at most {number.shown(number.largest):g} for {others}",
                found=f"{given[number.name]:g}",
                remedy="Give a smaller value.",
            )
    return light
