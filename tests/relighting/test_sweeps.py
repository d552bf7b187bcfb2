"""The ways of a spot that sweeps over a scene."""

from __future__ import annotations

import itertools
import math

import pytest
import torch

from rgspipe.relighting.sweeps import (
    SpotKind,
    aim_sweep,
    default_places,
    orbit_sweep,
    spread_frames,
    there_and_back,
)
from rgspipe.scene.lights import SpotLight
from rgspipe.scene.lights.angles import angle_from_axis

SPOT = SpotKind(SpotLight.shaped("smoothstep", 0.4, 0.15), torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64))


def vector(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


def test_a_spot_that_turns_stays_where_it_is_and_its_axis_goes_evenly_from_one_point_to_the_other() -> None:
    position, start, end = vector(0.1, 0.2, 1.0), vector(-1.0, 0.3, 0.0), vector(1.0, 0.0, 0.2)
    lights = aim_sweep(position, start, end, 7, SPOT)
    assert all(torch.equal(light.position, position) for light in lights)
    assert all(abs(float(light.direction.norm()) - 1.0) < 1e-12 for light in lights)  # measured 2e-16
    assert float(angle_from_axis(lights[0].direction, start - position)) < 1e-8  # measured 1e-9, that of the angle
    assert float(angle_from_axis(lights[-1].direction, end - position)) < 1e-8  # measured 1e-9
    turns = [float(angle_from_axis(before.direction, after.direction)) for before, after in itertools.pairwise(lights)]
    whole = float(angle_from_axis(start - position, end - position))
    assert turns == pytest.approx([whole / 6] * 6, rel=1e-9)  # measured 1e-15
    assert lights[0].profile == "smoothstep" and lights[0].cone_angle == 0.4 and lights[0].falloff == 0.15
    assert lights[3].intensity.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("start", "end", "words"),
    [
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), "stands on a point"),
        ((0.0, 0.0, 0.0), (0.0, 0.0, -3.0), "one direction"),
        ((0.0, 1.0, 1.0), (0.0, -2.0, 1.0), "opposite"),
    ],
)
def test_points_between_which_no_axis_turns_are_refused(start, end, words) -> None:
    with pytest.raises(ValueError, match=words):
        aim_sweep(vector(0.0, 0.0, 1.0), vector(*start), vector(*end), 5, SPOT)


def test_a_spot_goes_once_around_the_middle_and_looks_at_it() -> None:
    center = vector(0.5, -0.2, 0.1)
    lights = orbit_sweep(center, 2.0, 1.5, 8, SPOT)
    away = torch.stack([light.position for light in lights]) - center
    torch.testing.assert_close(away[:, :2].norm(dim=1), torch.full((8,), 2.0, dtype=torch.float64))
    assert (away[:, 2] - 1.5).abs().max() < 1e-12  # measured 0
    for light, offset in zip(lights, away, strict=True):
        assert float(angle_from_axis(light.direction, -offset)) < 1e-8  # measured 1e-9
    angles = torch.atan2(away[:, 1], away[:, 0]).remainder(2.0 * math.pi)
    expected = 0.25 * math.pi * torch.arange(8, dtype=torch.float64)
    assert (angles - expected).abs().max() < 1e-12, "the last frame is one step before the first"  # measured 9e-16
    with pytest.raises(ValueError, match="radius"):
        orbit_sweep(center, 0.0, 1.0, 4, SPOT)


def test_by_default_a_room_is_lit_from_inside_and_an_object_from_outside() -> None:
    lower, upper = vector(-1.0, -2.0, 0.0), vector(1.0, 2.0, 3.0)
    room = default_places((lower, upper), is_open=False)
    inside = [room.position, room.center + vector(room.radius, 0.0, room.height)]
    assert all(bool(((lower < place) & (place < upper)).all()) for place in inside)
    assert room.start[0] == -1.0 and room.end[0] == 1.0 and room.start[1] == room.end[1]
    turned = default_places((lower, upper), is_open=False, across=1)
    assert turned.start[1] == -2.0 and turned.end[1] == 2.0
    radius = 0.5 * float((upper - lower).norm())
    thing = default_places((lower, upper), is_open=True)
    assert float((thing.position - thing.center).norm()) > radius
    assert math.hypot(thing.radius, thing.height) > radius


def test_frames_of_a_strip_are_evenly_spread() -> None:
    assert spread_frames(48, 4) == [0, 16, 31, 47]
    assert spread_frames(48, 4, closed=True) == [0, 12, 24, 36]
    assert spread_frames(3, 8) == [0, 1, 2] and spread_frames(3, 8, closed=True) == [0, 1, 2]
    assert there_and_back([1, 2, 3, 4]) == [1, 2, 3, 4, 3, 2] and there_and_back([1, 2]) == [1, 2]
