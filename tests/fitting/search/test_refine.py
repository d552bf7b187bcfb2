"""When a refinement ends: where steps gain nothing that matters, and not where they still do."""

from __future__ import annotations

import pytest
import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.result import FitStatus
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.optim.levenberg_marquardt import Stopping


def _problem(room, point_light, noise: float) -> LightProblem:
    image = room.images(point_light(VISIBLE))[0]
    grain = torch.randn(image.shape, generator=torch.Generator().manual_seed(0))
    stacked = room.one.prepared.stack_images([image * (1.0 + noise * grain)])
    return LightProblem.create(room.one.prepared, stacked)


def _refined(problem: LightProblem, off: float) -> State:
    place = torch.tensor(VISIBLE, dtype=torch.float64)
    refiner = Refiner.of(problem)
    return refiner.refined(refiner.start([emitter_at(place + off)], PLAIN), PLAIN, 30)


def _error(state: State) -> float:
    return float((state.emitters[0].position - torch.tensor(VISIBLE, dtype=torch.float64)).norm())


@pytest.mark.parametrize("off", [0.02, 0.05])
def test_without_noise_steps_go_on_far_below_the_shortest(room, point_light, off: float) -> None:
    state = _refined(_problem(room, point_light, 0.0), off)
    assert state.status is FitStatus.CONVERGED
    assert _error(state) < 0.02 * Stopping().shortest_step  # measured 2e-8 and 1e-8


def test_with_noise_one_more_look_at_most_is_taken_at_the_answer(room, point_light) -> None:
    problem = _problem(room, point_light, 0.05)
    found = _refined(problem, 0.05)
    refiner = Refiner.of(problem)
    again = refiner.refined(found, PLAIN, 30)
    assert again.status is FitStatus.CONVERGED and refiner.meter.evaluations <= 1
    moved = float((again.emitters[0].position - found.emitters[0].position).norm())
    assert moved < Stopping().shortest_step * problem.views.frozen.size  # measured 0
    assert moved < 0.2 * _error(found), "what is left out is small beside what noise does"


def test_a_refined_state_is_another_and_goes_on_the_same_way(room, point_light) -> None:
    """States are values: the one before is as it was, its steps are the beginning of the new one's."""
    problem = _problem(room, point_light, 0.05)
    refiner = Refiner.of(problem)
    start = refiner.start([emitter_at(torch.tensor(VISIBLE, dtype=torch.float64) + 0.05)], PLAIN)
    before = start.emitters, start.intensity.clone()
    found = refiner.refined(start, PLAIN, 30)
    assert start.emitters is before[0] and torch.equal(start.intensity, before[1]) and len(start.steps) == 1
    assert found.steps[:1] == start.steps and refiner.meter.iterations == len(found.steps) - 1 > 0
    assert refiner.meter.evaluations >= len(found.steps)
    seconds = [step.seconds for step in found.steps]
    assert seconds == sorted(seconds) and seconds[-1] <= refiner.meter.seconds
