"""Lamps leave false minima for better ones beside, and stay in the best."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from lamp_problem import problem, true_lamps
from rgspipe.capture import likelihood, minima
from rgspipe.capture.candidates import CandidateLamps
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.likelihood import Comparison, Tried
from rgspipe.capture.minima import (
    LessLikely,
    likelier_among,
    likeliest,
    looked_beside,
    minima_beside,
    settled_beside,
    with_chances,
)
from rgspipe.capture.receivers import Receivers


@cache
def room() -> tuple[LampProblem, CandidateLamps]:
    made = replace(problem(), receivers=Receivers(problem().frozen.with_dictionary(8, seed=0)))
    return made, CandidateLamps.of(made)


def displaced() -> Lamps:
    """The true lamps, of which one was moved by a tenth of the room."""
    made, _ = room()
    places = true_lamps(made).places.copy()
    places[1] += 0.1 * made.size * np.array([0.6, -0.8, 0.0])
    return made.lamps(places, true_lamps(made).logs)


def distance(lamps: Lamps) -> float:
    """Of the farther one from the truth."""
    return float(np.linalg.norm(lamps.places - true_lamps(room()[0]).places, axis=1).max())


def test_a_lamp_goes_to_the_better_minimum_beside_it_and_stays_there() -> None:
    made, candidates = room()
    found = settled_beside(made, candidates, displaced())
    assert distance(found) < 0.003  # 3e-4 of the room
    assert all(looked_beside(made, candidates, found, own) is found for own in (0, 1))


def test_another_minimum_is_another_place() -> None:
    made, candidates = room()
    lamps = true_lamps(made)
    for own in (0, 1):
        costs = [made.cost(lamps)]
        for beside in minima_beside(made, candidates, lamps, own):
            assert np.linalg.norm(beside.places - lamps.places, axis=1).max() > made.resolved
            costs.append(made.cost(beside))
        assert costs == sorted(costs)


#: So far apart that one of the places around a false minimum, at the other side of the room, is near the truth.
FAR = np.array([[-0.7, 0.0, 0.0], [0.7, 0.0, 0.0]])


@cache
def false_minimum() -> tuple[CandidateLamps, Tried]:
    """Of which the second lamp stands at the other side of the room, and candidates that lead out of it."""
    made, _ = room()
    true = true_lamps(made)
    false = Tried.settled(made, made.lamps(true.places * [[1, 1, 1], [-1, 1, 1]], true.logs - 1.0))
    return CandidateLamps(FAR, np.zeros((len(made.radiance), 2))), false


@pytest.mark.slow
def test_a_lamp_goes_to_the_likelier_minimum_beside_it_and_stays_there() -> None:
    candidates, false = false_minimum()
    assert distance(false.lamps) > 0.5  # 0.70
    others: list[LessLikely] = []
    best = likeliest(candidates, false, others)
    assert distance(best.lamps) < 0.003  # 7e-4
    for own in (0, 1):
        assert likelier_among(best, minima_beside(best.problem, candidates, best.lamps, own), []) is best
    found = with_chances(best, others)
    # 0.093, by a chance of 5e-4; and 0.014
    assert all(distance(rival.tried.lamps) > 0.05 and rival.chance < 0.05 for rival in found.rivals)
    assert found.rivals


def test_a_minimum_that_is_known_is_not_settled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    candidates, false = false_minimum()
    beside = minima_beside(false.problem, candidates, false.lamps, 1)
    assert len(beside) > 1
    monkeypatch.setattr(Tried, "settled_if", lambda *_: pytest.fail("it is settled again"))
    others = [LessLikely(replace(false, lamps=lamps), false, Comparison(np.ones(1))) for lamps in beside]
    assert likelier_among(false, beside, others) is false


def test_looks_that_cannot_find_anything_else_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first look moves a lamp, and none after it does: the other lamp, and then the first one once more."""
    candidates, first = false_minimum()
    second, looks = replace(first), []
    monkeypatch.setattr(minima, "minima_beside", lambda *given: looks.append(given[3]) or [])
    monkeypatch.setattr(minima, "likelier_among", lambda *_: second)
    assert likeliest(candidates, first, []) is second
    assert looks == [0, 1, 0]


def test_what_was_compared_is_not_compared_again(monkeypatch: pytest.MonkeyPatch) -> None:
    _, false = false_minimum()
    gain = Comparison(np.ones(1))
    less = LessLikely(false, false, gain)
    monkeypatch.setattr(Tried, "over", lambda *_: pytest.fail("it is compared again"))
    assert less.than(false) is gain


def test_lamps_that_come_to_a_known_place_are_not_settled_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    _, false = false_minimum()
    rounds: list[Lamps] = []
    monkeypatch.setattr(likelihood, "settled_once", lambda problem, lamps: rounds.append(lamps) or (problem, lamps))
    assert Tried.settled_if(false.problem, false.lamps, lambda _: False) is None
    assert len(rounds) == 1
