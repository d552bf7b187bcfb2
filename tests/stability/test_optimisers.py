"""One Adam step and one Levenberg-Marquardt step from every hard place; then the optimiser goes on and improves."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from hard_cases import DEEP, INSIDE, LIGHTS, SCENES, HardScene, camera, scene_of_light
from rgspipe.errors import InputError
from rgspipe.fitting import FitResult, FitStatus, PaperAdam, Search
from rgspipe.fitting.fit import FitViews
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight

#: The light whose image is the target.
TRUTH = torch.tensor([-0.1, 0.15, 0.25], dtype=torch.float64)

#: Scenes that show a camera nothing: a fit refuses them, and says how many pixels are left.
INVISIBLE = ("zero width", "opacity 0", "no surfel", "anisotropy of 1e4")

#: Scenes that stay black whatever the light.
BLACK = ("albedo 0",)

#: Places from which no light reaches the room: there is no gradient to follow.
DARK = ("behind a surfel", "inside a solid", "on the boundary of the ball", "outside of the ball", "very far")

Kept = dict[int, tuple[FrozenScene, FitViews, Tensor]]


@pytest.fixture(scope="module")
def kept() -> Kept:
    return {}


def light_at(scene: HardScene, place: Tensor, exponent: float = 0.0) -> PointLight:
    """A light as bright as the scene is large, so that radiance is near 1."""
    return PointLight(scene.at(place), torch.full((3,), scene.size**2 * math.exp(exponent), dtype=torch.float64))


def prepare(kept: Kept, scene: HardScene, start: PointLight) -> tuple[FitViews, Tensor]:
    """One view with the start as the only candidate, and the target's image."""
    if id(scene) not in kept:
        frozen = FrozenScene.freeze(scene.build(), gather_rays=4, patches=20, seed=0)
        view = frozen.view(camera("plain", scene))
        kept[id(scene)] = frozen, view, frozen.render(view, (light_at(scene, TRUTH),), sharp=False)
    frozen, view, image = kept[id(scene)]
    irradiance, _ = frozen.unit_irradiance(start.position[None])
    candidate = LightDictionary(start.position[None].float(), irradiance)
    return FitViews.prepare(replace(frozen, candidates=candidate), view, mask_edges=False, sharp=False), image


def adam(kept: Kept, scene: HardScene, start: PointLight, steps: int) -> FitResult:
    """Adam from `start` exactly: the only training light is where the mean is and has no spread."""
    views, image = prepare(kept, scene, start)
    solver = PaperAdam(epochs=1, steps=steps, position_rate=0.01 * scene.size, training_lights=[start])
    return views.fit([image], solver=solver)


def levenberg(kept: Kept, scene: HardScene, start: PointLight, steps: int) -> FitResult:
    views, image = prepare(kept, scene, start)
    return views.fit([image], solver=Search(starts=1, iterations=steps))


def assert_goes_on(one: FitResult, more: FitResult, gain: float) -> None:
    """All steps are finite, the first is the same in both, and the loss falls below `gain` of the first.

    With more steps a search may go on from beside the minimum that they lead to; it tells the way from there.
    """
    for step in (*one.trajectory, *more.trajectory):
        assert math.isfinite(step.loss)
        assert torch.isfinite(step.position).all() and torch.isfinite(step.intensity).all()
    assert len(one.trajectory) >= 2
    if torch.equal(one.trajectory[0].position, more.trajectory[0].position):
        torch.testing.assert_close(one.trajectory[1].position, more.trajectory[1].position, rtol=0, atol=0)
    for covariance in (*one.covariance, *more.covariance):
        assert not torch.isnan(covariance).any()
    assert min(step.loss for step in more.trajectory) <= gain * one.trajectory[0].loss


@pytest.mark.parametrize("light", LIGHTS)
def test_adam_from_a_hard_place(kept: Kept, light: str) -> None:
    scene = scene_of_light(light)
    start = light_at(scene, LIGHTS[light])
    one, more = (adam(kept, scene, start, steps) for steps in (1, 15))
    assert_goes_on(one, more, 1.0 if light in DARK else 0.95)


@pytest.mark.parametrize("light", LIGHTS)
def test_levenberg_marquardt_from_a_hard_place(kept: Kept, light: str) -> None:
    scene = scene_of_light(light)
    start = light_at(scene, LIGHTS[light])
    one, more = (levenberg(kept, scene, start, steps) for steps in (1, 15))
    if light in DARK and not one.lights:  # nothing to begin from, and the fit says so
        assert one.status is more.status is FitStatus.NOT_ENOUGH_LIGHT
    else:
        assert_goes_on(one, more, 1.0 if light in DARK else 0.9)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SCENES if name not in (*INVISIBLE, *BLACK)])
def test_both_in_a_hard_scene(kept: Kept, name: str) -> None:
    scene = SCENES[name]
    start, more = light_at(scene, INSIDE, 0.5), 4 if name in DEEP else 15
    assert_goes_on(*(adam(kept, scene, start, steps) for steps in (1, more)), 0.98)
    assert_goes_on(*(levenberg(kept, scene, start, steps) for steps in (1, more)), 0.5)


@pytest.mark.parametrize("name", INVISIBLE)
def test_a_scene_that_shows_nothing_is_refused(kept: Kept, name: str) -> None:
    with pytest.raises(InputError, match="0 of 256"):
        prepare(kept, SCENES[name], light_at(SCENES[name], INSIDE))


@pytest.mark.parametrize("name", BLACK)
def test_a_black_scene_has_not_enough_light(kept: Kept, name: str) -> None:
    start = light_at(SCENES[name], INSIDE)
    for fit in (adam, levenberg):
        result = fit(kept, SCENES[name], start, 1)
        assert result.status is FitStatus.NOT_ENOUGH_LIGHT and result.lights == ()


@pytest.mark.parametrize("exponent", [-30.0, 30.0])
def test_both_from_the_ends_of_the_intensity_range(kept: Kept, exponent: float) -> None:
    """The start is 13 orders of magnitude too dim or too bright; the closed form does not care, Adam walks."""
    scene = SCENES["plain"]
    start = light_at(scene, INSIDE, exponent)
    assert_goes_on(*(adam(kept, scene, start, steps) for steps in (1, 15)), 1.0)
    assert_goes_on(*(levenberg(kept, scene, start, steps) for steps in (1, 15)), 0.1)


@pytest.mark.parametrize("scale", [1e-13, 1e13])
def test_a_search_finds_a_light_of_any_brightness(kept: Kept, scale: float) -> None:
    scene = SCENES["plain"]
    views, image = prepare(kept, scene, light_at(scene, INSIDE))
    fit = views.fit([scale * image], solver=Search(starts=1))
    # Measured below 1e-5.
    assert float((fit.lights[0].position - TRUTH).norm()) < 1e-3
    torch.testing.assert_close(fit.lights[0].intensity / scale, torch.ones(3, dtype=torch.float64), rtol=1e-3, atol=0)
