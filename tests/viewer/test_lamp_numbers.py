"""Numbers of lamps that a visitor types or steps with keys."""

from __future__ import annotations

import pytest
import torch

from rgspipe.scene import PointLight
from rgspipe.scene.lights import KINDS, Light
from rgspipe.viewer.lamp_numbers import RGB, Number, colour_of, level_of, numbers_of, with_colour

#: Aimed along none of the axes, and of a colour with three different channels.
PLACE, AXIS, COLOUR = [0.1, -0.2, 0.3], [0.48, 0.64, -0.6], [0.51, 0.6, 0.33]


def lamp(kind: str) -> Light:
    return KINDS[kind].shaped().at(*(torch.tensor(x, dtype=torch.float64) for x in (PLACE, AXIS, COLOUR)))


CASES = [(kind, one.label) for kind in KINDS for one in numbers_of(lamp(kind), 1.0)]


def named(light: Light, label: str) -> Number:
    return next(one for one in numbers_of(light, 1.0) if one.label == label)


@pytest.mark.parametrize(("kind", "label"), CASES)
def test_a_number_is_changed_and_no_other(kind: str, label: str) -> None:
    light = lamp(kind)
    before = {one.label: one.of(light) for one in numbers_of(light, 1.0)}
    value = before[label] - named(light, label).step
    changed = named(light, label).with_value(light, value)
    after = {one.label: one.of(changed) for one in numbers_of(changed, 1.0)}
    if label == "green":  # The brightest channel, by which the others are told.
        before |= {channel: before[channel] / 0.9 for channel in ("red", "blue")}
        value = 255.0
    # Angles go through the axis and back, measured 3e-14.
    assert after[label] == pytest.approx(value, abs=1e-9)
    # The fall-off of a spot is tied to its cone.
    rest = [name for name in before if name != label and not (label.startswith("cone") and "falloff" in name)]
    assert {name: after[name] for name in rest} == pytest.approx({name: before[name] for name in rest}, abs=1e-9)


def test_every_number_of_a_lamp_is_offered() -> None:
    labels = [one.label for one in numbers_of(lamp("panel"), 1.0)]
    assert labels == ["x", "y", "z", "heading °", "pitch °", *RGB, "W/sr", "width", "height", "turn °"]
    assert "x" not in [one.label for one in numbers_of(lamp("sun"), 1.0)], "a sun has no place"


def test_colour_and_level_are_apart() -> None:
    light = with_colour(lamp("point"), (255, 128, 0))
    assert (colour_of(light), level_of(light)) == ((255, 128, 0), pytest.approx(0.6))
    out = named(light, "W/sr").with_value(light, 0.0)
    assert level_of(out) == 0.0 and colour_of(out) == (255, 255, 255)
    assert level_of(named(out, "W/sr").with_value(out, 2.0)) == 2.0


def test_a_step_is_a_part_of_lengths_by_the_scene_and_of_all_else_by_its_value() -> None:
    """The exponent of an LED is no length: in a room of 400 units a key changed it by 4."""
    led, sphere = KINDS["led"].shaped(8.0), KINDS["sphere"].shaped(1.0)
    steps = [
        next(one for one in numbers_of(light, 400.0) if one.label == label).step
        for light, label in ((led, "exponent"), (sphere, "radius"))
    ]
    assert steps == pytest.approx([0.8, 4.0])


@pytest.mark.parametrize("size", [1e-3, 1.0, 400.0])
def test_what_is_shown_has_four_digits_of_the_scene_or_the_level(size: float) -> None:
    light = PointLight([size / 3.0, 0.0, 0.0], 1e-5 * size)
    for number in (numbers_of(light, size)[0], named(light, "W/sr")):
        value = number.of(light)
        assert round(value, number.decimals) == pytest.approx(value, rel=1e-3)
        assert 0.0 < number.step < value


def test_a_shape_that_no_lamp_has_is_refused() -> None:
    with pytest.raises(ValueError, match="radius"):
        named(lamp("sphere"), "radius").with_value(lamp("sphere"), -1.0)
