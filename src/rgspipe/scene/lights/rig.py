"""Several lights together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import NoReturn

from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.scene.arrays import check_finite
from rgspipe.scene.lights.light import Light

LightRig = tuple[Light, ...]


def as_rig(lights: Light | Sequence[Light]) -> LightRig:
    """A rig of several lights, or of one.

    Raises:
        InputError: something else.
    """
    if isinstance(lights, Light):
        return (lights,)
    if not isinstance(lights, Sequence) or isinstance(lights, str):
        _refuse("lights", "a light or a list of them", lights)
    for index, light in enumerate(lights):
        if not isinstance(light, Light):
            _refuse(f"lights[{index}]", "a light", light)
    return tuple(lights)


def check_numbers(rig: LightRig) -> None:
    """Refuse lights that are nowhere or aim nowhere.

    Raises:
        InputError: a number is not finite in single precision, or an axis has no length.
    """
    remedy = "Where steps moved it there, take shorter ones."
    for index, light in enumerate(rig):
        for field in fields(light):
            if isinstance(value := getattr(light, field.name), Tensor):
                # In float32, as light is computed.
                check_finite(value.float(), f"lights[{index}].{field.name}", remedy)
        if light.axis is not None and not bool(light.axis.float().any()):
            where = f"lights[{index}].direction"
            raise InputError(where, expected="a direction", found="(0, 0, 0)", remedy="Say where the light aims.")


def _refuse(where: str, expected: str, found: object) -> NoReturn:
    remedy = "Pass one, such as PointLight([0, 0, 0.3], 1.0), or the lights of a fit: result.lights."
    raise InputError(where, expected=expected, found=type(found).__name__, remedy=remedy)
