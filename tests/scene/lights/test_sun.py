"""Suns: what is special about light from infinity."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from lit_room import frozen_cube
from rgspipe.fitting.certainty.regions import inside
from rgspipe.light_export.world import World
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.rig import rig_irradiance
from rgspipe.scene import Camera, Gloss, PointLight
from rgspipe.scene.lights import SunLight

AXIS = torch.nn.functional.normalize(torch.tensor([-0.5, 0.4, -0.6], dtype=torch.float64), dim=0)
COLOUR = torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64)


@pytest.fixture(scope="module")
def cube() -> FrozenScene:
    return frozen_cube()


def test_a_surface_gets_the_cosine_of_it_wherever_it_is(cube: FrozenScene) -> None:
    found = rig_irradiance(cube.bvh, (SunLight([9.0, 9.0, 9.0], COLOUR, AXIS),))
    expected = (-(cube.bvh.surfels.normals.double() @ AXIS)).clamp(min=0.0)[:, None] * COLOUR
    torch.testing.assert_close(found.double(), expected, rtol=0.0, atol=1e-6)  # measured 5e-8


@pytest.mark.parametrize("elevation", [1e-2, 1e-4, 1e-7, 0.0, -1e-4])
def test_a_grazing_sun_is_finite_with_its_derivative(cube: FrozenScene, elevation: float) -> None:
    axis = torch.tensor([math.cos(elevation), 0.0, -math.sin(elevation)], dtype=torch.float64, requires_grad=True)
    lit = rig_irradiance(cube.bvh, (SunLight([0.0, 0.0, 0.0], 1.0, axis),))
    top = cube.bvh.surfels.normals[:, 2] > 0.5
    assert float(lit[top].detach().max()) == pytest.approx(max(0.0, math.sin(elevation)), rel=1e-5, abs=1e-9)
    lit.sum().backward()
    assert bool(torch.isfinite(axis.grad).all()) and bool((lit >= 0.0).all())


@pytest.mark.parametrize("glossy", [False, True])
def test_its_image_is_that_of_a_point_far_away(glossy: bool) -> None:
    """I R² from the distance R: where pixels look, in shadow, over gloss, and what bounces."""
    surfels = frozen_cube().surfels
    if glossy:
        shine = Gloss(torch.full((len(surfels), 3), 0.2), torch.full((len(surfels),), 12.0))
        surfels = replace(surfels, gloss=shine)
    scene, far = FrozenScene.freeze(surfels, gather_rays=16, patches=50), 1e4
    camera = Camera.look_at([1.2, -1.0, 0.9], [0.0, 0.0, 0.0], fov_degrees=40, width=24, height=24)
    for sharp in (False, True):
        sun = scene.render(camera, SunLight([0.0, 0.0, 0.0], COLOUR, AXIS), sharp=sharp)
        point = scene.render(camera, PointLight(-far * AXIS, far**2 * COLOUR), sharp=sharp)
        assert float(sun.max()) > 0.05
        # The point's rays differ by 1e-4 over the cube; measured 1.0e-4.
        assert float((sun - point).abs().max()) < 4e-4 * float(point.max())


def test_its_irradiance_is_the_same_in_metres() -> None:
    (found,) = World(metres=10.0).lights((SunLight([1.0, 0.0, 0.0], COLOUR, AXIS),))
    assert torch.equal(found.intensity, COLOUR) and found.position.tolist() == [10.0, 0.0, 0.0]


def test_its_region_holds_directions_as_far_off_as_it_says() -> None:
    """Directions lie on a sphere, and not on the plane in which they spread."""
    side = torch.linalg.cross(AXIS, torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64))
    side = side / side.norm()
    across = torch.eye(3, dtype=torch.float64) - torch.outer(AXIS, AXIS)
    sun = SunLight([0.0, 0.0, 0.0], COLOUR, AXIS)
    for deviation in (1e-4, 0.03, 0.3):
        covariance = torch.zeros(9, 9, dtype=torch.float64)
        covariance[3:6, 3:6] = deviation**2 * across
        for times, held in ((1.5, True), (3.5, False)):
            angle = times * deviation
            other = replace(sun, direction=math.cos(angle) * AXIS + math.sin(angle) * side)
            places = [one.standing(2.0) for one in (sun, other)]
            assert inside(places[:1], places[1:], [sun.standing_spread(covariance, 2.0)]) == held
    covariance[3:6, 3:6] = torch.diag(torch.full((3,), math.inf))
    assert not bool(torch.isnan(sun.standing_spread(covariance, 2.0)).any())
