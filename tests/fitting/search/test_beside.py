"""Minima beside an answer: none beside the truth, and the truth beside what is not a minimum."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from emitters import emitter_at
from lit_room import VISIBLE
from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.beside import _behind_a_rise, minima_beside, settled_beside
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.weighting import PLAIN

OPTIONS = SearchOptions()


def test_the_least_place_behind_a_rise_is_where_a_descent_starts() -> None:
    assert _behind_a_rise([1.0, 2.0, 3.0]) == 0
    assert _behind_a_rise([1.0, 3.0, 2.0, 2.5, 1.5]) == 4
    assert _behind_a_rise([3.0, 2.0, 2.5]) == 1


@pytest.fixture
def refiner(room, point_light) -> Refiner:
    images = room.images(point_light(VISIBLE))
    return Refiner.of(LightProblem.create(room.one.prepared, room.one.prepared.stack_images(images)))


def test_no_minimum_is_beside_the_truth(refiner: Refiner) -> None:
    true = replace(
        refiner.start([emitter_at(torch.tensor(VISIBLE, dtype=torch.float64))], PLAIN), status=FitStatus.CONVERGED
    )
    best, beside = settled_beside(refiner, true, OPTIONS)
    # Eight places on either side, and no descent.
    assert best is true and beside == () and refiner.meter.evaluations == 17 and refiner.meter.iterations == 0


def test_pixels_are_asked_only_where_blocks_do_not_tell(refiner: Refiner) -> None:
    """Beside the truth everything leaves many times as much: two steps on blocks, and none on pixels."""
    true = replace(
        refiner.start([emitter_at(torch.tensor(VISIBLE, dtype=torch.float64))], PLAIN), status=FitStatus.CONVERGED
    )
    before = refiner.meter.evaluations
    assert settled_beside(refiner, true, OPTIONS, blocks=refiner) == (true, ())
    assert refiner.meter.evaluations - before == 3  # The answer on blocks, once, and a step on either side.


def test_what_is_no_minimum_is_left(refiner: Refiner) -> None:
    off = refiner.start([emitter_at(torch.tensor(VISIBLE, dtype=torch.float64) + 0.05)], PLAIN)
    assert settled_beside(refiner, off, OPTIONS) == (off, ())  # its steps ran out, so that it is none
    best, *_ = minima_beside(refiner, off, OPTIONS)
    assert refiner.unexplained(best) < 1e-6 * refiner.unexplained(off)  # measured 6e-13
