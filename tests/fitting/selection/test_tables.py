"""Which luminaire of a catalogue a light is, from an answer with a wrong one, and where two are alike."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE
from luminaire_files import COLUMNS, photometry
from rgspipe.fitting import LightSpec
from rgspipe.fitting.findings import KindOpen
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import ScheduleOptions, SearchOptions
from rgspipe.fitting.search.compare import distinct
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.tables import tables_open, told_tables
from rgspipe.scene.lights import Photometry, ProfileLight

AXIS = torch.nn.functional.normalize(torch.tensor([0.1, 0.2, -1.0], dtype=torch.float64), dim=0)
OPTIONS = SearchOptions(schedule=ScheduleOptions(steps=8))


WINGS, TWIN, ROUND = (
    photometry(COLUMNS, "wings.ies"),
    photometry(COLUMNS, "twin.ies"),
    photometry((COLUMNS[0],), "round.ies"),
)


def lamp(measured: Photometry, off: float = 0.0, turn: float = 0.6) -> ProfileLight:
    return ProfileLight(torch.tensor(VISIBLE, dtype=torch.float64) + off, [1.0, 2.0, 0.5], AXIS, turn, measured)


def spec(*tables: Photometry) -> LightSpec:
    shape = replace(ProfileLight.shaped(0.0, tables[0]), catalogue=tables[1:])
    return LightSpec("profile", shape=shape, shape_free=True)


@pytest.fixture
def refiner(room) -> Refiner:
    images = [room.frozen.render(view, (lamp(WINGS),), sharp=False) for view in room.views]
    return Refiner.of(LightProblem.create(room.two.prepared, room.two.prepared.stack_images(images)))


def test_the_right_table_takes_the_place_of_a_wrong_one(refiner: Refiner) -> None:
    """From where the wrong one explains most, in another turn."""
    start = refiner.start([Emitter.of(lamp(ROUND, 0.03), shape_free=True)], PLAIN)
    wrong = refiner.refined(start, PLAIN, 8)
    best, others = told_tables(refiner, wrong, spec(ROUND, WINGS), OPTIONS)
    (found,) = best.emitters
    assert found.light.table is WINGS and wrong in others
    # Measured: 4e-15 of the energy is left where the other one left 0.0022.
    assert refiner.unexplained(best) < 1e-6 * refiner.unexplained(wrong)
    assert tables_open(refiner, best, others, OPTIONS) == ()


def test_tables_that_are_alike_are_told(refiner: Refiner) -> None:
    true = refiner.start([Emitter.of(lamp(WINGS), shape_free=True)], PLAIN)
    best, others = told_tables(refiner, true, spec(WINGS, TWIN), OPTIONS)
    wanted = "profile twin.ies" if best is true else "profile wings.ies"
    assert tables_open(refiner, best, others, OPTIONS) == (KindOpen(1, 1, wanted),)


def test_other_luminaires_in_one_place_are_other_rigs(refiner: Refiner) -> None:
    one, other = (refiner.start([Emitter.of(lamp(measured))], PLAIN) for measured in (WINGS, TWIN))
    assert distinct([one, other, one], OPTIONS.schedule.met, refiner.region.size) == [one, other]


def test_one_luminaire_has_no_other_table(refiner: Refiner) -> None:
    true = refiner.start([Emitter.of(lamp(WINGS))], PLAIN)
    assert told_tables(refiner, true, spec(WINGS), OPTIONS) == (true, ())
    assert refiner.meter.evaluations == 1
