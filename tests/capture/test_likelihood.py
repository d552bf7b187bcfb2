"""Lamps are compared by the variances that belong to each."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lamp_problem import problem, true_lamps
from rgspipe.capture.likelihood import Comparison, Tried, weighed


@cache
def settled() -> tuple[Tried, Tried]:
    """Lamps near where they are, and with one of them at the other end of the room, each with what belongs to it."""
    made, true = problem(), true_lamps(problem())
    far = true.places.copy()
    far[1] *= -1.0
    return (
        Tried.settled(made, made.lamps(true.places + 0.02, true.logs)),
        Tried.settled(made, made.lamps(far, true.logs - 1.0)),
    )


def test_lamps_settle_with_the_variances_that_belong_to_them() -> None:
    near, far = settled()
    assert np.linalg.norm(near.lamps.places - true_lamps(problem()).places, axis=1).max() < 0.003  # 7e-4
    assert far.problem.field.variances.step > 2.0 * near.problem.field.variances.step  # 500 times
    again = weighed(near.problem, near.lamps).field.variances
    np.testing.assert_allclose(again.step, near.problem.field.variances.step, rtol=0.1)  # 0


def test_of_two_the_true_lamps_are_likelier_whichever_is_asked() -> None:
    near, far = settled()
    gained, lost = near.over(far), far.over(near)
    assert gained.gain > 0.0 > lost.gain
    assert gained.gain == pytest.approx(-lost.gain, rel=1e-6)
    assert gained.odds < 0.05 and lost.odds == 1.0


def test_lamps_are_as_likely_as_they_are() -> None:
    near, _ = settled()
    assert near.over(near).gain == pytest.approx(0.0, abs=1e-3 * near.problem.field.measurements)


@given(arrays(np.float64, st.integers(1, 20), elements=st.floats(-1e6, 1e6)))
def test_odds_are_those_of_a_rival(gains: np.ndarray) -> None:
    odds = Comparison.of(gains).odds
    assert 0.0 <= odds <= 1.0
    assert odds == 1.0 or gains.sum() > 0.0
    assert Comparison.of(1e-3 * gains).odds == pytest.approx(odds)  # of no unit


def test_parts_that_say_the_same_leave_no_doubt() -> None:
    assert Comparison.of(np.full(12, 3.0)).odds == 0.0
    assert Comparison.of(np.full(12, -3.0)).odds == 1.0
    assert Comparison.of(np.array([30.0, -30.0])).odds == pytest.approx(1.0)
