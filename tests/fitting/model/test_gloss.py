"""Lights of glossy scenes: the fit's image is the renderer's, its derivatives are right, and fits use the lobes."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from emitters import emitter_at
from lit_room import VISIBLE, room_cameras, room_surfels
from rgspipe.fitting import FitViews
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Gloss, PointLight
from rgspipe.scene.lights import SpotLight

LIGHT = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64))
SPOT = emitter_at(
    torch.tensor([0.05, -0.2, 0.25], dtype=torch.float64),
    torch.nn.functional.normalize(torch.tensor([0.3, 0.4, -1.0], dtype=torch.float64), dim=0),
    SpotLight.shaped("gaussian", 0.4, 0.3),
    shape_free=True,
)


@pytest.fixture(scope="module")
def frozen() -> FrozenScene:
    """The room of the other tests with a glossy floor and back wall."""
    surfels = room_surfels()
    glossy = (surfels.centers[:, 2] < -0.45) | (surfels.centers[:, 1] > 0.45)
    reflectance = torch.where(glossy[:, None], 0.2, 0.0).expand(-1, 3).double()
    gloss = Gloss(reflectance, torch.where(glossy, 12.0, 1.0).double())
    return FrozenScene.freeze(replace(surfels, gloss=gloss), gather_rays=64, patches=100, seed=0)


def _views(frozen: FrozenScene, sharp: bool = False, **effects: bool) -> FitViews:
    return FitViews.prepare(frozen, room_cameras(24), effects=Effects(**effects), sharp=sharp)


def _problem(views: FitViews) -> LightProblem:
    return views.problem(views.prepared.stack_images(views.render((LIGHT,))))


def _largest_error(problem: LightProblem, emitter: Emitter, share: float = 1.0) -> list[float]:
    """Per parameter the relative error of the derivative, over that share of the pixels which agrees best."""
    columns, step = problem.evaluate(emitter), 1e-4
    errors = []
    for index in range(emitter.parameters):
        shift = torch.zeros(emitter.parameters, dtype=torch.float64)
        shift[index] = step
        units = emitter.units(1.0)
        ahead, behind = (problem.evaluate(emitter.moved(sign * shift / units, 1.0))[:, :, 0] for sign in (1, -1))
        expected = (ahead - behind) / (2.0 * step)
        apart = (columns[:, :, 1 + index] - expected).norm(dim=1)
        kept = apart.sort().values[: int(share * len(apart))]
        errors.append(float(kept.norm() / expected.norm()))
    return errors


def test_at_centres_the_image_is_the_renderer_s(frozen: FrozenScene) -> None:
    views = _views(frozen)
    image = _problem(views).evaluate(emitter_at(LIGHT.position))[:, :, 0] * LIGHT.intensity.float()
    expected = torch.cat([frozen.render(view, (LIGHT,), sharp=False).reshape(-1, 3) for view in views.prepared.views])
    torch.testing.assert_close(image, expected[views.prepared.pixels], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("interreflection", [True, False])
def test_at_pixels_the_image_is_that_of_a_rendering(frozen: FrozenScene, interreflection: bool) -> None:
    views = _views(frozen, sharp=True, interreflection=interreflection)
    problem = _problem(views).sharpest()
    for light, emitter in ((LIGHT, emitter_at(LIGHT.position)), (SPOT.shining(LIGHT.intensity), SPOT)):
        image = problem.evaluate(emitter)[:, :, 0] * light.intensity.float()
        expected = torch.cat([image.reshape(-1, 3) for image in views.render((light,))])
        torch.testing.assert_close(image, expected[views.prepared.pixels], rtol=1e-4, atol=1e-5)


def test_highlights_at_pixels_are_those_of_centres_where_surfels_are_small(frozen: FrozenScene) -> None:
    """They differ by what a lobe changes within a surfel; without lobes both images lose the same light."""
    sharp, plain = (_views(frozen, at_pixels).render((LIGHT,)) for at_pixels in (True, False))
    diffuse = replace(frozen, gloss=None)
    without = [_views(diffuse, at_pixels).render((LIGHT,)) for at_pixels in (True, False)]
    pairs = ((sharp, without[0]), (plain, without[1]))
    lobes = [sum(float((a - b).sum()) for a, b in zip(*pair, strict=True)) for pair in pairs]
    assert lobes[0] == pytest.approx(lobes[1], rel=0.03)


@pytest.mark.parametrize("at_pixels", [False, True])
@pytest.mark.parametrize("emitter", [emitter_at(LIGHT.position + 0.003), SPOT], ids=["point", "spot"])
def test_derivatives_match_finite_differences(frozen: FrozenScene, at_pixels: bool, emitter: Emitter) -> None:
    problem = _problem(_views(frozen, at_pixels)).sharpest()
    errors = _largest_error(problem, emitter, 0.95)
    assert max(errors) < 0.02, errors


def test_a_fit_finds_the_light_that_made_a_glossy_image_and_without_lobes_misplaces_it(frozen: FrozenScene) -> None:
    images = _views(frozen, sharp=True).render((LIGHT,))
    errors = []
    for scene in (frozen, replace(frozen, gloss=None)):
        views = FitViews.prepare(scene.with_dictionary(5), room_cameras(24), sharp=True)
        light = views.fit(images).lights[0]
        errors.append(float((light.position - LIGHT.position).norm()))
    assert errors[0] < 1e-4, errors
    assert errors[1] > 10.0 * errors[0], errors
