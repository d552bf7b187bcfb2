"""Lamps are compared by the variances that belong to each."""

from __future__ import annotations

from functools import cache

import numpy as np

from lamp_problem import problem, true_lamps
from rgspipe.capture.likelihood import Tried, weighed


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
    assert near.likelier_than(far) and not far.likelier_than(near)


def test_lamps_are_no_likelier_than_they_are() -> None:
    near, _ = settled()
    assert not near.likelier_than(near)
