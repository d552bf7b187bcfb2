"""Two lights close together, taken for one."""

from __future__ import annotations

from dataclasses import replace

import torch

from rgspipe.fitting import FitStatus
from rgspipe.fitting.findings import Rival
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.result import dark_result
from rgspipe.fitting.tracking.twins import split_lights, split_rigs
from rgspipe.scene import LightRig


def _problem(room, rig: LightRig) -> LightProblem:
    stacked = room.two.prepared.stack_images([room.frozen.render(view, rig, sharp=False) for view in room.views])
    return LightProblem.create(room.two.prepared, stacked, room.two.effects)


def test_two_lights_that_were_taken_for_one_and_a_faint_one_are_found_by_splitting(room, point_light) -> None:
    truth = (point_light((0.07, -0.25, 0.3)), point_light((0.15, -0.25, 0.3)))
    taken = (point_light((0.11, -0.25, 0.3), (2.0, 4.0, 1.0)), point_light((0.3, 0.3, -0.3), (0.01, 0.02, 0.005)))
    problem = _problem(room, truth)
    wrong = replace(dark_result(0.0), lights=taken, findings=(Rival(0.2),), loss=0.02)
    result = split_lights(problem, wrong, room.two.blocks)
    assert result.loss < 1e-6
    found = sorted(float(light.position[0]) for light in result.lights)
    # Measured: 1e-5.
    assert abs(found[0] - 0.07) < 2e-3 and abs(found[1] - 0.15) < 2e-3


def test_an_answer_that_splitting_does_not_better_stays(room, point_light) -> None:
    rig = (point_light((0.1, -0.25, 0.3)), point_light((-0.3, 0.3, 0.3)))
    right = replace(dark_result(0.0), lights=rig, findings=(), loss=1e-12)
    kept = split_lights(_problem(room, rig), right, room.two.blocks)
    assert kept.lights == rig and kept.status == FitStatus.CONVERGED


def test_halves_stand_on_both_sides_and_the_faintest_light_gives_way(point_light) -> None:
    bright, middle = point_light((0.0, 0.0, 0.0), (4.0, 4.0, 4.0)), point_light((0.5, 0.0, 0.0))
    faint = point_light((0.2, 0.2, 0.2), (0.1, 0.1, 0.1))
    result = replace(dark_result(0.0), lights=(bright, faint, middle))
    rigs = split_rigs(result, 0.1)
    # Two lights that may be split, along three directions each.
    assert len(rigs) == 6 and all(len(rig) == 3 for rig in rigs)
    first, second, third = rigs[0]
    torch.testing.assert_close(first.position - second.position, torch.tensor([0.1, 0.0, 0.0]).double())
    torch.testing.assert_close(third.position, middle.position)
