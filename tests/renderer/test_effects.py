"""Effects are left out only where the image does not change by more than the tolerance."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.renderer.effects import EffectBounds, choose_effects, measure_effects, sample_lights
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Surfels
from rooms import closed_box, rectangle, sphere, surfels_on


def plane() -> Surfels:
    points, normals = rectangle([-0.5, -0.5, 0], [1, 0, 0], [0, 1, 0], 0.05)
    return surfels_on(points, normals, 0.05, 0.8)


def ball() -> Surfels:
    """A convex object in empty space: the outside of a sphere."""
    inside = sphere(800, albedo=0.6, radius=0.5)
    x, y, z = inside.centers.unbind(1)
    outward = torch.stack([x, y, z], dim=1)
    return surfels_on(outward, torch.nn.functional.normalize(outward, dim=1), 0.06, 0.6)


def screened() -> Surfels:
    floor, up = rectangle([-0.5, -0.5, 0], [1, 0, 0], [0, 1, 0], 0.05)
    screen, normals = rectangle([-0.2, -0.2, 0.2], [0.4, 0, 0], [0, 0.4, 0], 0.05)
    return surfels_on(torch.cat([floor, screen]), torch.cat([up, normals]), 0.05, 0.5)


SCENES = {
    "plane": (plane, False, False),
    "convex object": (ball, None, False),
    "screen over a floor": (screened, True, None),
    "white room": (lambda: closed_box(1 / 8, 0.8), None, True),
    "nearly black room": (lambda: closed_box(1 / 8, 1e-5), None, False),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("tolerance", [1e-3, 0.05])
def test_the_chosen_effects_stay_within_the_tolerance(name: str, tolerance: float) -> None:
    """Lights that the choice has not seen; the error is measured against the brightest direct radiance."""
    build, shadows, interreflection = SCENES[name]
    frozen = FrozenScene.freeze(build(), gather_rays=32, patches=40, seed=0)
    choice = choose_effects(measure_effects(frozen, seed=0), tolerance)
    if tolerance == 1e-3:
        assert shadows is None or choice.shadows == shadows, choice.reasons
        assert interreflection is None or choice.interreflection == interreflection, choice.reasons
    worst = 0.0
    for position in sample_lights(frozen, seed=7)[::4]:
        full = frozen.radiance(frozen.unit_irradiance(position[None])[0].T)
        chosen = frozen.radiance(frozen.unit_irradiance(position[None], choice.shadows)[0].T, choice.interreflection)
        brightest = frozen.radiance(frozen.unit_irradiance(position[None], shadows=False)[0].T, indirect=False).amax()
        worst = max(worst, float((full - chosen).abs().amax() / brightest.clamp(min=1e-30)))
    assert worst <= tolerance


def test_the_bound_on_interreflection_is_attained() -> None:
    """No direct radiance of at most 1 sends more light around than that of 1 everywhere."""
    frozen = FrozenScene.freeze(closed_box(1 / 8, 0.5), gather_rays=32, patches=40, seed=0)
    bound = measure_effects(frozen, seed=0).interreflection
    # A closed room of albedo ρ: ρ/(1 − ρ) = 1. Measured 1.0000.
    assert bound == pytest.approx(1.0, rel=1e-3)
    direct = torch.rand(len(frozen.surfels), 3, 8, generator=torch.Generator().manual_seed(0))
    assert float(frozen.transport.indirect(direct).amax()) <= bound


def test_a_shadow_left_out_also_lights_what_its_receiver_lights() -> None:
    bounds = EffectBounds(interreflection=9.0, shadows=1e-4, shadow_milliseconds=1.0, interreflection_milliseconds=1.0)
    assert choose_effects(bounds, 1e-3).shadows
    assert not choose_effects(replace(bounds, interreflection=0.0), 1e-3).shadows
