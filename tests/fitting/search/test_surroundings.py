"""Open scenes are told from closed ones, and lights far around them are found."""

from __future__ import annotations

import pytest
import torch

from lit_room import solid_box
from rgspipe.fitting import build_dictionary, fit_lights, prepare_fit
from rgspipe.fitting.search.surroundings import OPEN, REACH, is_open, region_bounds, shell_points
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight, look_at
from rooms import surfels_on

RADIUS = 0.5 * 0.5 * 3.0**0.5


@pytest.fixture(scope="module")
def cube() -> FrozenScene:
    """The outside of a cube of side 0.5."""
    surfels = surfels_on(*solid_box((0.0, 0.0, 0.0), 0.5, 0.05), 0.05, torch.tensor([0.6, 0.5, 0.4]).double())
    return FrozenScene.freeze(surfels, gather_rays=16, patches=50, seed=0)


def test_a_room_is_closed_and_a_cube_open(room, cube: FrozenScene) -> None:
    # Measured 0.0 and 1.0.
    assert room.frozen.openness < 0.1 * OPEN and cube.openness > 0.99
    assert is_open(cube) and not is_open(room.frozen)


def test_lights_are_looked_for_where_they_may_be(room, cube: FrozenScene) -> None:
    lower, upper = region_bounds(cube)
    # Centres of surfels end half a spacing before the cube does.
    assert float((upper - lower).min()) == pytest.approx(2 * REACH * RADIUS, rel=0.11)
    lower, upper = region_bounds(room.frozen)
    assert float((upper - lower).max()) == pytest.approx(1.5 * room.frozen.size)
    points = shell_points(cube)
    assert bool(((points >= region_bounds(cube)[0]) & (points <= region_bounds(cube)[1])).all())


@pytest.mark.parametrize("distance", [1.5, 3.0])
def test_a_light_far_from_an_object_is_found(cube: FrozenScene, distance: float) -> None:
    light = PointLight(distance * RADIUS * torch.tensor([0.6, -0.64, 0.48]).double(), torch.tensor([1.0, 2.0, 0.5]))
    pose = look_at(torch.tensor([0.9, -0.7, 0.8]), torch.zeros(3))
    camera = Camera.from_field_of_view(pose, 0.7, 48, 48)
    views = prepare_fit(cube, [camera], dictionary=build_dictionary(cube, 4, seed=0))
    result = fit_lights(cube, views, [cube.render(cube.view(camera), (light,))])
    error = float((result.lights[0].position - light.position).norm()) / cube.size
    assert error < 1e-5  # measured 9e-8 and 3e-7
