"""How the answer moves with the places of guessed surfaces, against fits of images where these stand elsewhere."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, VISIBLE, room_cameras, room_surfels
from rgspipe.fitting.certainty.guessed_shadows import shadow_scores
from rgspipe.fitting.certainty.uncertainty import light_covariances
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.target_views import TargetViews
from rgspipe.renderer.displaced import displaced
from rgspipe.renderer.effects import ALL_EFFECTS
from rgspipe.renderer.frozen import FrozenScene

#: Direct light and its shadows.
DIRECT = replace(ALL_EFFECTS, interreflection=False)


def back_of_box(surfels) -> torch.Tensor:
    """(N,) bool."""
    x, normal = surfels.centers[:, 0], surfels.normals[:, 0]
    return (normal > 0.9) & (x > 0.1)


def wall_behind(surfels) -> torch.Tensor:
    """(N,) bool: the wall behind the cameras, which casts no shadow."""
    return (surfels.centers[:, 0] < -0.49) & (surfels.normals[:, 0] > 0.9)


@pytest.fixture(scope="module")
def scene() -> FrozenScene:
    surfels = room_surfels()
    marked = replace(surfels, guessed=0.3 * (back_of_box(surfels) | wall_behind(surfels)).double())
    return FrozenScene.freeze(marked, gather_rays=64, patches=150, seed=0)


def problem_of(scene: FrozenScene, seen_in: FrozenScene, light) -> LightProblem:
    """Sharp images of one scene, to be explained by another."""
    views = TargetViews.prepare(scene, room_cameras(32), effects=DIRECT)
    images = views.images.among(seen_in).image((light,))
    return views.problem(images).sharpest()


def state_of(problem: LightProblem, light) -> State:
    emitter = Emitter.of(light)
    return State((emitter,), (problem.evaluate(emitter),), light.intensity[None].double() / problem.scale)


def doubt_of(scene: FrozenScene) -> float:
    """Of the place of the box's back: a distance of its surfels over √12."""
    return float((scene.areas[back_of_box(scene.surfels)].median() / 12.0).sqrt())


def test_a_face_that_stands_elsewhere_moves_the_answer_as_foretold(scene, point_light):
    light = point_light(HIDDEN)
    exact = problem_of(scene, scene, light)
    state = state_of(exact, light)
    weights = PLAIN.at(exact, state.columns, state.intensity)
    scores = shadow_scores(exact, state, weights)
    # The wall behind the cameras is left out.
    assert scores.shape == (1, 6)
    step = 0.1 * doubt_of(scene)
    along = step * back_of_box(scene.surfels)[:, None] * scene.surfels.normals
    wrong = problem_of(scene, displaced(scene, along.double()), light)
    refiner = Refiner.of(wrong)
    found = refiner.refined(refiner.start([Emitter.of(light)], PLAIN), PLAIN, 30).lights(wrong)[0]
    information = exact.moments(state.columns, weights).information(state.intensity)
    spread = torch.block_diag(state.emitters[0].spread(), exact.scale * torch.eye(3, dtype=torch.float64))
    foretold = spread @ torch.linalg.solve(information, scores[0]) * step / doubt_of(scene)
    moved = (found.position - light.position).double()
    # Measured relative difference 0.034.
    assert float((moved - foretold[:3]).norm()) < 0.1 * float(moved.norm())


def test_doubt_about_a_face_widens_the_region_of_a_light_behind_it_alone(scene, point_light):
    widths = {}
    for where in (HIDDEN, VISIBLE):
        light = point_light(where)
        problem = problem_of(scene, scene, light)
        state = state_of(problem, light)
        for doubted in (True, False):
            matrix = light_covariances(problem, state, displaced=doubted).calibrated[0]
            widths[where, doubted] = float(matrix[:3, :3].trace().sqrt())
    # Images are explained to rounding. Measured 0.33 of what the face is in doubt by, and 3e-8 without.
    assert 0.2 * doubt_of(scene) < widths[HIDDEN, True] < 0.5 * doubt_of(scene)
    assert widths[HIDDEN, False] < 1e-6
    assert widths[VISIBLE, True] == widths[VISIBLE, False]


def test_without_shadows_or_guesses_nothing_is_doubted(scene, point_light):
    light = point_light(HIDDEN)
    problem = problem_of(scene, scene, light)
    state = state_of(problem, light)
    weights = PLAIN.at(problem, state.columns, state.intensity)
    lit = replace(problem, model=replace(problem.model, effects=replace(DIRECT, shadows=False)))
    assert shadow_scores(lit, state, weights).shape == (0, 6)
    seen = replace(scene, surfels=replace(scene.surfels, guessed=torch.zeros_like(scene.surfels.guessed)))
    problem = problem_of(seen, seen, light)
    assert shadow_scores(problem, state_of(problem, light), weights).shape == (0, 6)
