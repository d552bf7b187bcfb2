"""Bounds on the radiance of surfaces that are clipped everywhere: some hold the lamps, the others say nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lamp_problem import gather, problem, radiance, true_lamps, unseen
from rgspipe.capture.bounds import with_bounds
from rgspipe.capture.lamps import LampProblem
from rgspipe.capture.received import Received


def clipped(part: float) -> tuple[LampProblem, np.ndarray]:
    """The problem in which the brightest surfels are known to send at least `part` of what they do."""
    made = problem()
    grey = radiance().mean(axis=1)
    bright = ~unseen() & (grey > np.quantile(grey, 0.8))
    pixels = np.where(bright, np.inf, made.pixels)
    least = np.where(bright[:, None], part * radiance(), radiance())
    field = replace(made.field, measured=pixels, trust=np.isfinite(pixels).astype(np.float64))
    received = Received.of(gather(), least, np.isfinite(pixels), made.predicted)
    bounds = np.where(bright, 1e-4, np.inf)
    return replace(made, field=field, received=received, radiance=least, pixels=pixels, clipped=bounds), bright


def test_bounds_that_lamps_meet_say_nothing() -> None:
    made, bright = clipped(0.6)
    found, _ = with_bounds(made, true_lamps(made))
    assert np.isinf(found.pixels[bright]).mean() > 0.95
    np.testing.assert_array_equal(found.pixels[~bright], made.pixels[~bright])


def test_bounds_that_lamps_do_not_meet_are_measurements() -> None:
    made, bright = clipped(1.6)
    found, lamps = with_bounds(made, true_lamps(made))
    assert np.isfinite(found.pixels[bright]).mean() > 0.95
    # What they send is taken from them, and no longer what lamps make of them.
    assert len(found.received.unseen) < len(made.received.unseen)
    assert found.received.seen.sum() > made.received.seen.sum()
    assert np.isfinite(found.residual(lamps)).all()


def test_none_counts_before_there_are_lamps() -> None:
    made, _ = clipped(1.6)
    assert with_bounds(made, None) == (made, None)
