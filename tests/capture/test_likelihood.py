"""Lamps are compared by the variances that belong to each."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import norm

from lamp_problem import problem, true_lamps
from rgspipe.capture.likelihood import Comparison, Tried, chances, weighed


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
    assert gained.doubt < 0.05 and lost.doubt > 0.95  # 0.014 and 0.986


def test_lamps_are_as_likely_as_they_are() -> None:
    near, _ = settled()
    assert near.over(near).gain == pytest.approx(0.0, abs=1e-3 * near.problem.field.measurements)


@given(arrays(np.float64, st.integers(1, 20), elements=st.floats(-1e6, 1e6)))
def test_a_doubt_is_a_chance_of_no_unit(gains: np.ndarray) -> None:
    doubt = Comparison(gains).doubt
    assert 0.0 <= doubt <= 1.0
    assert Comparison(8.0 * gains).doubt == doubt


def test_parts_that_all_say_the_same_leave_no_doubt_however_much_each_says() -> None:
    assert Comparison(np.array([1e6, *np.full(11, 1.0)])).doubt == 0.0
    assert Comparison(np.array([-1e6, *np.full(11, -1.0)])).doubt == 1.0
    assert Comparison(np.array([30.0, -30.0])).doubt == pytest.approx(0.25, abs=0.03)  # 0.252


def test_one_part_that_decides_is_missing_from_a_third_of_the_draws() -> None:
    doubt = Comparison(np.array([1e6, *np.full(11, -1.0)])).doubt
    assert doubt == pytest.approx((11 / 12) ** 12, abs=0.03)  # 0.356 where 0.352 is exact


def test_doubts_are_a_normal_distribution_s_where_parts_are_many() -> None:
    gains = 1.0 + 10.0 * np.random.default_rng(3).standard_normal(200)
    deviations = gains.sum() / np.sqrt(200 * gains.var())
    assert Comparison(gains).doubt == pytest.approx(norm.cdf(-deviations), abs=0.02)


def test_chances_are_shared_by_all_that_are_compared() -> None:
    apart = [Comparison(np.array([3.0, -1.0, -1.0])), Comparison(np.array([-1.0, 3.0, 3.0]))]
    shared = chances(apart)
    assert shared.sum() == pytest.approx(1.0) and (shared[1:] > 0.0).all()
    np.testing.assert_array_equal(chances([]), [1.0])
    np.testing.assert_array_equal(chances(apart), shared)  # the same draws
