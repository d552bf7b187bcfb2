"""Lights and cameras of the same numbers are equal; large things are equal to themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

import rgspipe as rg
from rgspipe.scene.lights import KINDS, Light

LIGHTS = [kind.shaped() for kind in KINDS.values()]


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: light.kind)
def test_lights_are_equal_where_all_their_numbers_are(light: Light) -> None:
    same = type(light).shaped()
    assert light == same and (light != same) is False and len({light, same}) == 1
    assert LIGHTS.index(same) == [one.kind for one in LIGHTS].index(light.kind)
    assert light != replace(light, position=light.position + 1e-6) and light != replace(light, intensity=2.0)
    for number in light.shape:
        assert light != replace(light, **{number.name: getattr(light, number.name) + 0.01})


def test_gradients_change_nothing_and_rounding_does() -> None:
    light = rg.PointLight([0.1, 0.2, 0.3], 1.0)
    wanted = replace(light, position=light.position.clone().requires_grad_())
    assert light == wanted and hash(light) == hash(wanted)
    double = rg.PointLight(torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64), 1.0)
    assert double != double.to(torch.float32)


def test_other_kinds_and_other_things_are_not_equal() -> None:
    assert rg.PointLight([0, 0, 0], 1.0) != rg.LedLight([0, 0, 0], 1.0, [0, 0, -1], 1.0)
    assert rg.PointLight([0, 0, 0], 1.0) != "point" and rg.PointLight([0, 0, 0], 1.0) is not None


def test_a_light_that_is_moved_in_place_stays_where_it_was_put() -> None:
    light = rg.PointLight(torch.zeros(3), 1.0)
    held = {light: "lamp"}
    light.position.add_(1.0)
    assert held[light] == "lamp"


def test_what_was_saved_is_read_as_it_was(tmp_path: Path) -> None:
    lights = (rg.PointLight([0.1, 0.2, 0.3], [1.0, 2.0, 3.0]), rg.LedLight([0, 0, 1], 2.0, [0, 0, -1], 3.0))
    rg.write_lights(tmp_path / "lights.json", lights)
    read = rg.read_lights(tmp_path / "lights.json")
    assert [light.to(torch.float32) for light in read] == [light.to(torch.float32) for light in lights]


def test_cameras_are_equal_where_all_their_numbers_are() -> None:
    one, same, other = (rg.Camera.look_at([0, -2, 0], [0, 0, z], width=8, height=8) for z in (0.0, 0.0, 0.1))
    assert one == same and one != other and one != replace(one, width=9)


def test_surfels_and_scenes_are_equal_to_themselves_alone() -> None:
    surfels = rg.exact_surfels(rg.CornellBox(), 60)
    again = surfels
    assert surfels == again and surfels != replace(surfels) and len({surfels, replace(surfels)}) == 2
