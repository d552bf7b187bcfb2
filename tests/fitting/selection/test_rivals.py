"""Whether other lights explain as much: not by rounding, and not because a covariance says so."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from emitters import placed, refiner_of
from rgspipe.fitting.findings import Rival
from rgspipe.fitting.options import BarOptions, RivalOptions, ScheduleOptions, SearchOptions
from rgspipe.fitting.search.compare import drop
from rgspipe.fitting.selection.rivals import (
    as_good_nearby,
    equally_good,
    rival_among,
    rival_elsewhere,
    rival_polished,
    told_rival,
)


def test_rigs_that_leave_only_rounding_are_equally_good(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    true, near, far = (placed(refiner, by) for by in (0.0, 1e-7, 1e-4))
    # Measured: they leave 1e-15, 8e-14 and 7e-8 of the energy.
    assert refiner.unexplained(near) < 1e-12 < refiner.unexplained(far)
    assert drop(refiner.problem, near, true) == drop(refiner.problem, true, near) == 0.0
    assert all(equally_good(refiner.problem, *pair, RivalOptions()) for pair in ((true, near), (near, true)))
    assert drop(refiner.problem, far, true) > 0.5 and not equally_good(refiner.problem, true, far, RivalOptions())


def test_a_place_that_is_not_determined_is_looked_at(room, point_light) -> None:
    """Six others are tried, and as the images tell them apart after all, there is no rival."""
    refiner = refiner_of(room, point_light)
    known = torch.eye(6, dtype=torch.float64)
    unknown = torch.diag(torch.tensor([torch.inf, 1.0, 1.0, 1.0, 1.0, 1.0], dtype=torch.float64))
    for covariance, tried in ((known, 0), (unknown, 6)):
        true = placed(refiner, 0.0)
        before = refiner.meter.evaluations
        assert rival_elsewhere(refiner, true, [covariance], SearchOptions()) is None
        assert refiner.meter.evaluations - before == tried


#: Nearly everything is as good as the answer.
LENIENT = SearchOptions(
    rivals=RivalOptions(deviations=1000.0, energy=1000.0),
    bar=BarOptions(least_faint=1.0),
    schedule=ScheduleOptions(steps=2),
)


def test_a_rival_says_how_far_it_is(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    off, unknown = placed(refiner, 0.02), torch.diag(torch.tensor([torch.inf] * 3 + [1.0] * 3, dtype=torch.float64))
    found = rival_elsewhere(refiner, off, [unknown], LENIENT)
    # A light is moved so far, unless the edge of the room stops it.
    assert found is not None
    assert told_rival(refiner, off, found).distance == pytest.approx(LENIENT.certainty.doubtful, rel=1e-9)


def test_rivals_of_another_number_have_no_distance(room, point_light) -> None:
    refiner = refiner_of(room, point_light)
    one = placed(refiner, 0.02)
    two = placed(refiner, 0.02, 0.1)
    assert rival_among(refiner, one, [one], LENIENT) is None
    rival = rival_among(refiner, one, [one, two], LENIENT)
    assert rival is not None and len(rival.emitters) == 2
    assert rival_polished(refiner, one, [rival], LENIENT) is rival
    assert told_rival(refiner, one, rival) == Rival(None)


def test_what_explains_as_much_nearby_is_no_rival(room, point_light) -> None:
    """It is nearer than lights that are clearly apart, and farther than those on their way to one place."""
    refiner = refiner_of(room, point_light)
    off, near, met, far = (placed(refiner, by) for by in (0.02, 0.04, 0.021, -0.1))
    assert as_good_nearby(refiner, off, [near, met, far], LENIENT) == [near]
    assert rival_polished(refiner, off, [near, met], LENIENT) is None
    assert rival_polished(refiner, off, [near, met, far], LENIENT) is far
    strict = replace(LENIENT, rivals=RivalOptions())
    assert as_good_nearby(refiner, placed(refiner, 0.0), [near], strict) == []
