"""Which of several rigs is better, how much, and which lights are worth keeping."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from emitters import emitter_at
from lit_room import HIDDEN, VISIBLE
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import RivalOptions, SearchOptions
from rgspipe.fitting.search.compare import (
    best_state,
    distinct,
    drop,
    passed,
    ranked,
    rig_distance,
    worth_keeping,
)
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import ROBUST
from rgspipe.fitting.selection.rivals import equally_good
from rgspipe.scene.lights import SpotLight

BAR, MET = SearchOptions().bar, SearchOptions().schedule.met


@pytest.fixture(scope="module")
def problem(room, point_light) -> LightProblem:
    image = room.images(point_light(VISIBLE))[0]
    noise = torch.randn(image.shape, generator=torch.Generator().manual_seed(0))
    noisy = image + 0.02 * image.mean() * noise
    return LightProblem.create(room.one.prepared, room.one.prepared.stack_images([noisy]))


def state(problem: LightProblem, *places: tuple[float, float, float]) -> State:
    emitters = [emitter_at(torch.tensor(place, dtype=torch.float64)) for place in places]
    return Refiner.of(problem).start(emitters, ROBUST)


def shifted(place: tuple[float, float, float], by: float) -> tuple[float, float, float]:
    return (place[0] + by, place[1], place[2])


def test_the_true_light_is_better_than_another(problem: LightProblem) -> None:
    true, other = state(problem, VISIBLE), state(problem, HIDDEN)
    assert best_state(problem, [other, true]) is true
    assert drop(problem, other, true) > 0.5 and not equally_good(problem, true, other, RivalOptions())


def test_there_may_be_nothing_to_rank(problem: LightProblem) -> None:
    assert ranked(problem, []) == []


def test_a_light_more_than_there_are_gains_next_to_nothing(problem: LightProblem) -> None:
    one, two = state(problem, VISIBLE), state(problem, VISIBLE, HIDDEN)
    assert abs(drop(problem, one, two)) < 0.01  # measured 4e-5


def lit_by_two(room, point_light, strength: float, noise: float) -> tuple[float, float, bool]:
    """The hidden light at `strength` beside the visible one: its share, by how much it lowers the cost, the verdict."""
    first, second = (room.images(point_light(place))[0] for place in (VISIBLE, HIDDEN))
    image = first + strength * second
    grain = torch.randn(image.shape, generator=torch.Generator().manual_seed(0))
    stacked = room.one.prepared.stack_images([image * (1.0 + noise * grain)])
    problem = LightProblem.create(room.one.prepared, stacked)
    one, two = state(problem, VISIBLE), state(problem, VISIBLE, HIDDEN)
    share = float(strength * second.mean() / image.mean())
    return share, drop(problem, one, two), passed(problem, one, two, BAR)


def test_a_faint_light_must_explain_more_than_a_bright_one(room, point_light) -> None:
    """One at 17 % of the energy is taken for what lowers the cost by 31 %, one at 4 % is not, but for 84 %."""
    share, gain, there = lit_by_two(room, point_light, strength=0.25, noise=0.1)
    assert share > BAR.faint and BAR.least < gain < BAR.least_faint and there  # measured 0.167, 0.309
    share, gain, there = lit_by_two(room, point_light, strength=0.05, noise=0.03)
    assert share < BAR.faint and BAR.least < gain < BAR.least_faint and not there  # measured 0.039, 0.258
    share, gain, there = lit_by_two(room, point_light, strength=0.05, noise=0.003)
    assert share < BAR.faint and gain > BAR.least_faint and there  # measured 0.039, 0.838


def test_rigs_within_the_noise_are_equally_good(problem: LightProblem) -> None:
    """A shift of 1e-4 is far below what the noise allows to tell."""
    true = state(problem, VISIBLE)
    assert equally_good(problem, true, state(problem, shifted(VISIBLE, 1e-4)), RivalOptions())
    assert not equally_good(problem, true, state(problem, shifted(VISIBLE, 0.1)), RivalOptions())


def test_distance_of_rigs_is_that_of_the_best_matching() -> None:
    rig = [emitter_at(torch.tensor(place, dtype=torch.float64)) for place in (VISIBLE, HIDDEN)]
    assert rig_distance(rig, rig[::-1], 1.0) == 0.0
    moved = rig[0].placed(rig[0].position + torch.tensor([0.0, 0.3, 0.0]))
    assert rig_distance(rig, [rig[1], moved], 1.0) == pytest.approx(0.3)
    assert rig_distance(rig, rig[:1], 1.0) == float("inf")


def test_twins_are_merged_and_faint_lights_dropped(problem: LightProblem) -> None:
    three = state(problem, VISIBLE, shifted(VISIBLE, 0.01), HIDDEN)
    for strengths, kept in (((0.5, 1.0, 1.0), [1, 2]), ((0.0, 1.0, 1e-3), [1])):
        intensity = torch.tensor(strengths, dtype=torch.float64)[:, None].expand(3, 3)
        assert worth_keeping(replace(three, intensity=intensity), BAR, MET, 1.0) == kept


def test_rigs_that_met_are_refined_once(problem: LightProblem) -> None:
    """Of rigs on their way to the same place the first is left, in whichever order their lights stand."""
    size = problem.views.frozen.size
    near, far = shifted(VISIBLE, 0.9 * MET * size), shifted(VISIBLE, 1.1 * MET * size)
    first, second, third = state(problem, VISIBLE), state(problem, near), state(problem, far)
    kept = distinct([first, second, third], MET, size)
    assert [one is other for one, other in zip(kept, [first, third], strict=True)] == [True, True]
    pair, swapped = state(problem, VISIBLE, HIDDEN), state(problem, HIDDEN, near)
    assert distinct([pair, swapped], MET, size) == [pair]
    assert distinct([first, pair], MET, size) == [first, pair], "another number of lights is another rig"


def test_spots_that_point_elsewhere_have_not_met(problem: LightProblem) -> None:
    shape = SpotLight.shaped("smoothstep", 0.5, 0.3)
    place = torch.tensor(VISIBLE, dtype=torch.float64)
    turned = [torch.tensor([math.sin(angle), 0.0, -math.cos(angle)], dtype=torch.float64) for angle in (0, 0.005, 0.3)]
    spots = [Refiner.of(problem).start([emitter_at(place, axis, shape)], ROBUST) for axis in turned]
    assert distinct(spots, MET, 1.0) == [spots[0], spots[2]]
    wider = Refiner.of(problem).start([emitter_at(place, turned[0], SpotLight.shaped("smoothstep", 0.6, 0.3))], ROBUST)
    assert distinct([spots[0], wider], MET, 1.0) == [spots[0], wider]
    assert distinct([state(problem, VISIBLE), spots[0]], MET, 1.0)[1] is spots[0], "a point light is no spot"
