"""How the answer moves with guessed albedo, against fits of images of scenes whose guess was wrong."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, VISIBLE, room_cameras, room_surfels
from rgspipe.fitting.certainty.guesses import guess_scores
from rgspipe.fitting.certainty.uncertainty import light_covariances
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import prepare_views
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.renderer.frozen import FrozenScene

#: Doubt of the two walls that were guessed, in log albedo.
DOUBT = 0.3


def guessed(surfels) -> torch.Tensor:
    """(N,) bool: the wall behind the cameras, and the back of the box."""
    x, normal = surfels.centers[:, 0], surfels.normals[:, 0]
    return ((x < -0.49) & (normal > 0.9)) | ((normal > 0.9) & (x > 0.1))


@pytest.fixture(scope="module")
def scene() -> FrozenScene:
    surfels = room_surfels()
    marked = replace(surfels, guessed=DOUBT * guessed(surfels).double())
    return FrozenScene.freeze(marked, gather_rays=64, patches=150, seed=0)


def wrong_by(scene: FrozenScene, factor: float) -> FrozenScene:
    """The scene as it is where the guess of the first surface was too dark by a factor; the same rays."""
    x = scene.surfels.centers[:, 0]
    chosen = (scene.surfels.guessed > 0.0) & (x < -0.49)
    albedo = torch.where(chosen[:, None], factor * scene.surfels.albedo, scene.surfels.albedo)
    surfels = replace(scene.surfels, albedo=albedo, centers=scene.centers)
    return FrozenScene.freeze(surfels.to(torch.float64), gather_rays=64, patches=150, seed=0)


def problem_of(scene: FrozenScene, seen_in: FrozenScene, light) -> LightProblem:
    """Images of one scene, to be explained by another."""
    views = [scene.view(camera, 1) for camera in room_cameras(32)]
    prepared = prepare_views(scene, views)
    images = [seen_in.render(camera, light, sharp=False) for camera in (view.camera for view in views)]
    return LightProblem.create(prepared, prepared.stack_images(images))


def state_of(problem: LightProblem, light) -> State:
    emitter = Emitter.of(light)
    return State((emitter,), (problem.evaluate(emitter),), light.intensity[None].double() / problem.scale)


@pytest.mark.parametrize("where", [VISIBLE, HIDDEN])
def test_a_wrong_guess_moves_the_answer_as_foretold(scene, point_light, where):
    light = point_light(where)
    exact = problem_of(scene, scene, light)
    state = state_of(exact, light)
    weights = PLAIN.at(exact, state.columns, state.intensity)
    scores = guess_scores(exact, state, weights)
    assert scores.shape == (2, 6)
    step = 0.02
    wrong = problem_of(scene, wrong_by(scene, 1.0 + step), light)
    refiner = Refiner.of(wrong)
    found = refiner.refined(refiner.start([Emitter.of(light)], PLAIN), PLAIN, 30).lights(wrong)[0]
    information = exact.moments(state.columns, weights).information(state.intensity)
    # Unknowns of the moments are in natural units, intensities over the scale of the image.
    spread = torch.block_diag(state.emitters[0].spread(), exact.scale * torch.eye(3, dtype=torch.float64))
    foretold = spread @ torch.linalg.solve(information, scores[0]) * step / DOUBT
    moved = torch.cat([found.position - light.position, found.intensity - light.intensity]).double()
    # Measured relative differences 0.009 and 0.030 of positions, 0.005 and 0.019 of intensities.
    assert float((moved - foretold)[:3].norm()) < 0.1 * float(moved[:3].norm())
    assert float((moved - foretold)[3:].norm()) < 0.1 * float(moved[3:].norm())


def test_guesses_widen_the_region_and_nothing_guessed_leaves_it(scene, point_light):
    light = point_light(HIDDEN)
    seen = replace(scene, surfels=replace(scene.surfels, guessed=torch.zeros_like(scene.surfels.guessed)))
    widths = {}
    for name, frozen in (("guessed", scene), ("seen", seen)):
        problem = problem_of(frozen, frozen, light)
        matrix = light_covariances(problem, state_of(problem, light)).calibrated[0]
        widths[name] = float(matrix[:3, :3].trace().sqrt())
        assert float(torch.linalg.eigvalsh(matrix).min()) > 0.0
    # Measured 1e5: without a guess the images are explained to rounding.
    assert widths["guessed"] > 3.0 * widths["seen"]


def test_where_light_does_not_bounce_a_guess_does_nothing(scene, point_light):
    light = point_light(VISIBLE)
    problem = problem_of(scene, scene, light)
    effects = replace(problem.model.effects, interreflection=False)
    dark = replace(problem, model=replace(problem.model, effects=effects))
    state = state_of(dark, light)
    assert guess_scores(dark, state, PLAIN.at(dark, state.columns, state.intensity)).shape == (0, 6)
