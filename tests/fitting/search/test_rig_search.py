"""The parts of a search for a rig that are seen by themselves."""

from __future__ import annotations

import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.compare import worth_keeping
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.rig_search import RigSearch
from rgspipe.fitting.search.weighting import ROBUST


def test_lights_that_meet_by_plain_squares_are_one(room, point_light):
    """Where a worse rig of one light fewer was accepted, the next one holds two lights on their way to one place."""
    problem = LightProblem.create(
        room.two.prepared, room.two.prepared.stack_images(room.images(point_light(VISIBLE), 2))
    )
    refiner = Refiner.of(problem)
    search = RigSearch(refiner, [])
    place = torch.tensor(VISIBLE, dtype=torch.float64)
    apart = torch.tensor([0.6 * search.options.schedule.met * problem.views.frozen.size, 0.0, 0.0], dtype=torch.float64)
    twins = refiner.start([emitter_at(place - apart), emitter_at(place + apart)], ROBUST)
    assert len(worth_keeping(twins, search.options.bar, 2.0 * float(apart[0]) / 1.2, 1.0)) == 2
    (found,) = search.without_twins(twins).emitters
    assert float((found.position - place).norm()) < 1e-4  # measured 3e-8
