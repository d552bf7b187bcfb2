"""Rigs are what was asked for, and say of themselves what they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from rgspipe.blender.pool.rigs import HEADLIGHT_COLOUR, RigRequest, draw_rigs, headlight_rigs, unit_power
from rgspipe.errors import InputError
from rgspipe.scene import Light, PointLight, SpotLight

ONES = torch.ones(3, dtype=torch.float64)
DOWN = torch.tensor([0.0, 0.0, -1.0], dtype=torch.float64)


def _pool() -> list[Light]:
    """Six points and six spots in turn, 0.2 apart on a line."""
    places = [torch.tensor([0.2 * k, 0.0, 0.0], dtype=torch.float64) for k in range(12)]
    return [
        SpotLight(place, ONES, DOWN, "gaussian", 0.3, 0.1) if k % 2 else PointLight(place, ONES)
        for k, place in enumerate(places)
    ]


POOL = _pool()
#: Spots put less light into the images by what their power is less.
BRIGHTNESS = np.array([np.full(3, (0.5 + 0.1 * k) / unit_power(light)) for k, light in enumerate(POOL)])


def test_lights_come_first_in_turn_and_alone_when_one_is_wanted() -> None:
    rigs = draw_rigs(POOL, BRIGHTNESS, RigRequest(30))
    assert [rig.members for rig in rigs] == [(k % 12,) for k in range(30)]
    assert all(rig.shares == (1.0,) for rig in rigs)
    assert len({tuple(rig.lights[0].intensity.tolist()) for rig in rigs}) == 30


def test_a_rig_does_not_depend_on_how_many_there_are() -> None:
    request = RigRequest(9, (1, 3))
    few, many = draw_rigs(POOL, BRIGHTNESS, request), draw_rigs(POOL, BRIGHTNESS, replace(request, number=20))
    assert [rig.members for rig in few] == [rig.members for rig in many[:9]]
    assert all(torch.equal(a.lights[0].intensity, b.lights[0].intensity) for a, b in zip(few, many[:9], strict=True))
    other = draw_rigs(POOL, BRIGHTNESS, replace(request, seed=1))
    assert [rig.members for rig in few] != [rig.members for rig in other]


def test_several_lights_are_apart_and_the_weakest_is_strong_enough() -> None:
    rigs = draw_rigs(POOL, BRIGHTNESS, RigRequest(200, (1, 3), weakest=0.2, separation=0.45))
    assert {len(rig.members) for rig in rigs} == {1, 2, 3}
    for rig in rigs:
        assert len(set(rig.members)) == len(rig.members)
        radiance = [BRIGHTNESS[k] @ light.intensity.numpy() for k, light in zip(rig.members, rig.lights, strict=True)]
        np.testing.assert_allclose(rig.shares, np.array(radiance) / np.sum(radiance))
        assert len(rig.members) == 1 or min(rig.shares) >= 0.2
        places = [light.position[0].item() for light in rig.lights]
        assert all(abs(a - b) > 0.45 for k, a in enumerate(places) for b in places[:k])


def test_mixed_rigs_hold_both_types() -> None:
    rigs = draw_rigs(POOL, BRIGHTNESS, RigRequest(50, (2, 3), mixed=True, weakest=0.1))
    assert all({type(light) for light in rig.lights} == {PointLight, SpotLight} for rig in rigs)


def test_a_spot_has_the_power_of_a_point_light() -> None:
    spot = POOL[1]
    assert float(replace(spot, intensity=unit_power(spot) * ONES).power()[0]) == pytest.approx(4.0 * math.pi)
    assert unit_power(POOL[0]) == 1.0


def test_headlights_go_in_pairs_of_one_intensity() -> None:
    rigs = headlight_rigs(POOL[1::2], BRIGHTNESS[1::2])
    assert [rig.members for rig in rigs] == [(0, 1), (2, 3), (4, 5)]
    for rig in rigs:
        for light in rig.lights:
            np.testing.assert_allclose(light.intensity, np.array(HEADLIGHT_COLOUR) * unit_power(POOL[1]))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"count": (3, 2)}, r"RigRequest\.count.*3 to 2"),
        ({"count": (1, 13)}, r"RigRequest\.count.*12 lights of the pool"),
        ({"count": (2, 4), "weakest": 0.25}, r"RigRequest\.weakest.*below 0\.25"),
        ({"count": (2, 2), "weakest": 0.499}, r"2 lights.*none in .* draws.*RigRequest\.weakest"),
        ({"count": (3, 3), "separation": 1.2}, r"at least 1\.2 from each other.*RigRequest\.separation"),
    ],
)
def test_what_can_not_be_is_refused_with_a_way_out(values: dict, words: str) -> None:
    darker = BRIGHTNESS * np.logspace(0, -12, 12)[:, None] if values.get("weakest") == 0.499 else BRIGHTNESS
    with pytest.raises(InputError, match=words):
        draw_rigs(POOL, darker, RigRequest(1, **values))
