"""How lights move: what a step does, and that evaluations' derivatives are those of the step."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from emitters import emitter_at
from rgspipe.fitting import FitViews
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.mount import Mount
from rgspipe.renderer.effects import Effects
from rgspipe.scene.lights import KINDS, LedLight, Light, PointLight, SpotLight
from rgspipe.scene.lights.coordinates import tangents
from rgspipe.scene.lights.spot import CONE
from rgspipe.scene.walls import Wall

PLACE = torch.tensor([0.1, -0.25, 0.3], dtype=torch.float64)
AXIS = torch.nn.functional.normalize(torch.tensor([-0.3, 0.5, -0.6], dtype=torch.float64), dim=0)
SHAPES = [
    SpotLight.shaped("gaussian", 0.4, 0.3),
    SpotLight.shaped("smoothstep", 0.7, 0.8),
    SpotLight.shaped("linear", 0.8, 0.3),
]

#: A wide one, of which much arrives in the room wherever it is aimed.
SPOT = SpotLight.shaped("gaussian", 1.2, 0.5)

#: Every kind, in every shape that a search tries.
ANY = [shape for kind in KINDS.values() for shape in kind.shaped().variants()]


def name_of(light: Light) -> str:
    return " ".join([light.kind, *(f"{getattr(light, number.name):.3g}" for number in light.shape)])


def test_steps_keep_axes_on_the_sphere_and_cones_in_range() -> None:
    emitter = emitter_at(PLACE, AXIS, SpotLight.shaped("gaussian", 0.4, 0.2), shape_free=True)
    generator = torch.Generator().manual_seed(0)
    for scale in (0.01, 1.0, 100.0):
        moved = emitter.moved(scale * torch.randn(7, generator=generator, dtype=torch.float64), 2.0)
        assert float(moved.axis.norm()) == pytest.approx(1.0, abs=1e-12)
        assert 0.0 < moved.light.cone_angle <= CONE.high and 0.0 < moved.light.falloff < math.pi


def test_a_turn_is_as_long_as_its_step() -> None:
    emitter = emitter_at(PLACE, AXIS, SHAPES[0])
    turned = emitter.moved(torch.tensor([0, 0, 0, 0.03, -0.04], dtype=torch.float64), 1.0)
    assert math.acos(float(turned.axis @ AXIS)) == pytest.approx(0.05, abs=1e-8)
    basis = torch.cat([tangents(emitter.axis), AXIS[None]])
    torch.testing.assert_close(basis @ basis.T, torch.eye(3, dtype=torch.float64), rtol=0, atol=1e-12)


@pytest.mark.parametrize("at_pixels", [False, True])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_derivatives_of_a_spot_s_image_agree_with_finite_differences(room, shape: SpotLight, at_pixels: bool) -> None:
    """Towards every parameter, direct light and bounces, at surfels' centres and where pixels look.

    Without shadows, which are the same as a point light's and jump where hits part into layers.
    """
    emitter = emitter_at(PLACE, AXIS, shape, shape_free=True, softness=0.1)
    # Measured at most 0.0008, float32 differences over a short step.
    assert slopes_off(room, emitter, at_pixels) < 0.005


@pytest.mark.parametrize("at_pixels", [False, True])
@pytest.mark.parametrize("distance", [None, 0.1], ids=["at any distance", "at a known distance"])
@pytest.mark.parametrize("shape", [PointLight.shaped(), LedLight.shaped(), SPOT], ids=lambda shape: shape.kind)
def test_derivatives_of_what_hangs_on_a_surface_are_those_of_its_steps(room, shape, distance, at_pixels: bool) -> None:
    """Along it and away from it: they were those along x, y and z."""
    mount = Mount(Wall(torch.tensor([0.1, -0.25, 0.5]).double(), AXIS), distance)
    hung = mount.hung(shape.at(PLACE, AXIS.roll(1)), PLACE, 1.0)
    # Measured at most 0.0028, of the distance, which moves least.
    assert slopes_off(room, Emitter(hung, mount=mount), at_pixels) < 0.01


def slopes_off(room, emitter: Emitter, at_pixels: bool) -> float:
    """How far derivatives of an image are from differences, relative to these, the worst of the parameters."""
    views = FitViews.prepare(room.frozen, room.views[:1], effects=Effects(shadows=False), sharp=at_pixels)
    target = torch.ones(room.views[0].camera.pixel_count, 3)
    problem = views.problem(target).sharpest()
    slopes = problem.evaluate(emitter)[:, :, 1:] * emitter.units(1.0).float()
    assert slopes.shape[2] == emitter.parameters
    step, worst = 2e-4, 0.0
    for k in range(emitter.parameters):
        shift = step * torch.eye(emitter.parameters, dtype=torch.float64)[k]
        ahead, behind = (problem.evaluate(emitter.moved(sign * shift, 1.0))[:, :, 0] for sign in (1, -1))
        expected = (ahead - behind) / (2.0 * step)
        worst = max(worst, float((slopes[:, :, k] - expected).abs().median() / expected.abs().median()))
    return worst


@pytest.mark.parametrize("shape", [*ANY, *SHAPES], ids=name_of)
def test_derivatives_of_a_relative_intensity_are_those_of_steps(shape: Light) -> None:
    """Through what is tied to another field, and in the units of steps; of every kind."""
    emitter = emitter_at(PLACE, AXIS, shape, shape_free=True)
    generator = torch.Generator().manual_seed(0)
    points = PLACE + torch.nn.functional.normalize(torch.randn(3000, 3, generator=generator, dtype=torch.float64))
    relative = shape.at(PLACE, AXIS).relative_intensity(points, shape_free=True)
    if relative is None:
        assert emitter.axis is None or emitter.light.distant
        return
    slopes = emitter.slopes(relative.by) * emitter.units(2.0).float()
    for k in range(emitter.parameters):
        step = 1e-5 * torch.eye(emitter.parameters, dtype=torch.float64)[k]
        ends = [emitter.moved(sign * step, 2.0).light.relative_intensity_towards(points) for sign in (1, -1)]
        expected = (ends[0] - ends[1]) / 2e-5
        # Measured at most 2.1e-5, of a cone of 15°.
        assert float((slopes[:, k] - expected).abs().max()) <= 1e-4 * float(expected.abs().max())


@pytest.mark.parametrize("shape", ANY, ids=name_of)
def test_an_emitter_leads_to_another_and_back(shape: Light) -> None:
    emitter = emitter_at(PLACE, AXIS, shape, shape_free=True)
    step = 1e-4 * torch.linspace(-1.0, 1.0, emitter.parameters, dtype=torch.float64)
    other = emitter.moved(step, 2.0)
    # Second order; measured 5e-9.
    torch.testing.assert_close(emitter.offset(other, 2.0), step, rtol=0, atol=3e-8)
    assert emitter.distance(other, 2.0) == other.distance(emitter, 2.0) > 0.0
    rows = emitter.rows()
    assert list(rows) == [*emitter.coordinates, "intensity"]
    assert rows["intensity"].stop == len(emitter.spread()) + 3
    for known in (emitter, replace(emitter, shape_free=False)):
        count = known.rows()["intensity"].stop
        assert Emitter.fitted(other.light, torch.zeros(count, count)).parameters == known.parameters
