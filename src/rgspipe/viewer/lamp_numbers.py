"""The numbers of a lamp that a visitor types or steps with keys: place, direction, colour, level and shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

from rgspipe.fitting.result_text import decimals_of
from rgspipe.scene.lights import Light
from rgspipe.scene.lights.shape_coordinates import Length
from rgspipe.scene.lights.shape_number import ShapeNumber

#: Of lengths, a part of the scene's size; of colours, of full; of angles, degrees; of all else a part of the value.
STEP, SHARE, TURN = 0.01, 0.1, 2.0

#: Digits that are shown of a length of the scene's size, and of a level.
DIGITS = 4

#: Weakest level of a lamp that its colour can still be told at.
FAINT = 1e-9

#: Of the lamp's brightest channel, and so of full colour.
FULL = 255.0

RGB = ("red", "green", "blue")


@dataclass(frozen=True)
class Number:
    """One number of lamps of a kind.

    Attributes:
        label: its name and unit.
        help: a sentence.
        of: its value for a lamp.
        with_value: the lamp with another value; raises ValueError where there is no such lamp.
        step: by which a key changes it.
        decimals: that are shown.
    """

    label: str
    help: str
    of: Callable[[Light], float]
    with_value: Callable[[Light, float], Light]
    step: float
    decimals: int


def numbers_of(light: Light, size: float) -> list[Number]:
    """The numbers of a lamp in a scene of `size`, in the order in which they are listed."""
    decimals = decimals_of(size, DIGITS)
    numbers = [] if light.distant else [_place(axis, size, decimals) for axis in range(3)]
    if light.axis is not None:
        numbers += [
            Number("heading °", "Where it shines: 0 is +x, 90 is +y.", _heading, _headed, TURN, 1),
            Number("pitch °", "-90 shines straight down, 90 straight up.", _pitch, _pitched, TURN, 1),
        ]
    numbers += [_channel(index) for index in range(3)]
    level = level_of(light)
    told = "Irradiance across it" if light.distant else "Intensity"
    hint = f"{told} of the brightest channel."
    numbers.append(
        Number(light.unit, hint, level_of, _levelled, SHARE * (level or 1.0), decimals_of(level or 1.0, DIGITS))
    )
    return numbers + [_shape(number, light, size) for number in light.shape]


def level_of(light: Light) -> float:
    """Intensity of the brightest channel."""
    level = float(light.intensity.amax())
    return max(level, 0.0) if math.isfinite(level) else 0.0


def colour_of(light: Light) -> tuple[int, int, int]:
    """A lamp's colour in bytes, the brightest channel 255; white if it is out."""
    red, green, blue = (round(FULL * x) for x in _hue(light).tolist())
    return red, green, blue


def with_colour(light: Light, colour: Sequence[float] | Tensor) -> Light:
    """The lamp in another colour (3,) of which the brightest channel counts as 255, as strong as it is."""
    hue = torch.as_tensor(colour, dtype=torch.float64).clamp(0.0, FULL) / FULL
    return light.at(light.position, None, level_of(light) * hue / hue.amax().clamp(min=1.0 / FULL))


def _hue(light: Light) -> Tensor:
    level = level_of(light)
    return light.intensity.double() / level if level > FAINT else torch.ones(3, dtype=torch.float64)


def _levelled(light: Light, level: float) -> Light:
    return light.at(light.position, None, max(level, 0.0) * _hue(light))


def _place(axis: int, size: float, decimals: int) -> Number:
    def moved(light: Light, value: float) -> Light:
        position = light.position.clone()
        position[axis] = value
        return light.at(position)

    hint = "Of the lamp, scene units; or drag the gizmo."
    return Number("xyz"[axis], hint, lambda light: float(light.position[axis]), moved, _rounded(STEP * size), decimals)


def _channel(index: int) -> Number:
    def changed(light: Light, value: float) -> Light:
        colour = FULL * _hue(light)
        colour[index] = value
        return with_colour(light, colour)

    hint = "Of the colour, whose brightest channel is 255: less of that is more of the others."
    return Number(RGB[index], hint, lambda light: FULL * float(_hue(light)[index]), changed, SHARE * FULL, 0)


def _shape(number: ShapeNumber, light: Light, size: float) -> Number:
    def changed(light: Light, value: float) -> Light:
        return light.changed(number.name, number.natural(value))

    name = number.name.replace("_", " ")
    step, decimals = _steps(number, _shown(number, light), size)
    hint = f"The lamp's {name}{' in degrees' if number.unit == '°' else ''}."
    return Number(f"{name} {number.unit}".strip(), hint, partial(_shown, number), changed, step, decimals)


def _steps(number: ShapeNumber, value: float, size: float) -> tuple[float, int]:
    """By which a key changes a number of a shape, and with how many decimals it is shown."""
    if number.unit == "°":
        return TURN, 1
    if isinstance(number.coordinate, Length):
        return _rounded(STEP * size), decimals_of(size, DIGITS)
    return _rounded(SHARE * (value or 1.0)), decimals_of(value or 1.0, DIGITS)


def _shown(number: ShapeNumber, light: Light) -> float:
    return number.shown(float(getattr(light, number.name)))


def _heading(light: Light) -> float:
    x, y, _ = _axis(light)
    return math.degrees(math.atan2(y, x))


def _pitch(light: Light) -> float:
    return math.degrees(math.asin(min(max(_axis(light)[2], -1.0), 1.0)))


def _headed(light: Light, degrees: float) -> Light:
    return _aimed(light, degrees, _pitch(light))


def _pitched(light: Light, degrees: float) -> Light:
    return _aimed(light, _heading(light), min(max(degrees, -90.0), 90.0))


def _aimed(light: Light, heading: float, pitch: float) -> Light:
    around, up = math.radians(heading), math.radians(pitch)
    axis = [math.cos(up) * math.cos(around), math.cos(up) * math.sin(around), math.sin(up)]
    return light.at(light.position, torch.tensor(axis, dtype=torch.float64))


def _axis(light: Light) -> list[float]:
    assert light.axis is not None
    return light.axis.tolist()


def _rounded(value: float) -> float:
    """To a digit: what is stepped by it stays readable."""
    return float(f"{value:.0e}")
