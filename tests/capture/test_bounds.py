"""Bounds on the radiance of surfaces that are clipped everywhere: some hold the lamps, the others say nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lamp_problem import gather, in_all_channels, problem, radiance, true_lamps, unseen
from rgspipe.capture.bounds import with_bounds
from rgspipe.capture.lamps import LampProblem
from rgspipe.capture.received import Received


def clipped(part: float) -> tuple[LampProblem, np.ndarray]:
    """The problem in which the red of the brightest surfels is known to be at least `part` of what it is."""
    made, red = problem(), np.array([True, False, False])
    bright = (~unseen() & (radiance()[:, 0] > np.quantile(radiance()[:, 0], 0.8)))[:, None] & red
    told = ~unseen()[:, None] & ~bright
    least = np.where(bright, part, 1.0) * radiance()
    received = Received.of(gather(), least, told, made.predicted)
    made = replace(made, field=replace(made.field, told=told), received=received, radiance=least, clipped=bright)
    return made, bright


def test_bounds_that_lamps_meet_say_nothing() -> None:
    made, bright = clipped(0.6)
    found, _ = with_bounds(made, true_lamps(made))
    assert found.field.told[bright].mean() < 0.02  # 0.004
    np.testing.assert_array_equal(found.field.told[~bright], made.field.told[~bright])


def test_bounds_that_lamps_do_not_meet_are_measurements() -> None:
    made, bright = clipped(1.6)
    found, lamps = with_bounds(made, true_lamps(made))
    held = bright & found.field.told
    assert held.sum() > 0.95 * bright.sum()
    assert (found.field.channel(0).weight[held[:, 0]] > 0.0).all()
    # What they send is taken from them, and no longer what lamps make of them.
    assert found.received.told.sum() > made.received.told.sum()
    expected = np.log(found.radiance / found.predicted / found.arriving(lamps))
    np.testing.assert_allclose(found.residual(lamps), expected)


def test_none_counts_before_there_are_lamps() -> None:
    made, _ = clipped(1.6)
    assert with_bounds(made, None) == (made, None)


def test_channels_that_are_not_clipped_are_measured() -> None:
    made, bright = clipped(0.6)
    start = made.lamps(true_lamps(made).places + 0.05, true_lamps(made).logs - 0.2)
    found = made.refined(start, 30)
    assert np.linalg.norm(found.places - true_lamps(made).places, axis=1).max() < 0.003
    weights = [made.field.channel(c).weight[bright[:, 0]] for c in range(3)]
    assert (weights[0] == 0.0).all() and (weights[1] > 0.0).all() and (weights[2] > 0.0).all()
    assert made.field.measurements == sum(int((made.field.channel(c).weight > 0.0).sum()) for c in range(3))


def test_unseen_light_of_channels_is_that_of_each_alone() -> None:
    """A surfel that sends known red and unknown green is seen in one problem and unseen in another."""
    made, _ = clipped(1.0)
    told = made.field.told
    apart = [Received.of(gather(), radiance(), in_all_channels(own), made.predicted) for own in told.T]
    for channel, own in enumerate(apart):
        np.testing.assert_allclose(made.received.known[:, channel], own.known[:, channel], rtol=1e-6)  # 5e-7
