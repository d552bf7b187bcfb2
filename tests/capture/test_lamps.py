"""What arrives at surfels, and how the cost changes with the lamps, against dense algebra and finite differences."""

from __future__ import annotations

import numpy as np

from lamp_problem import gather, problem, radiance, true_lamps, unseen
from photographed_room import frozen_room
from rgspipe.capture.received import Received


def test_light_that_comes_back_from_the_unseen_is_that_of_the_whole_scene() -> None:
    made = problem()
    albedo = made.arriving(true_lamps(made))
    expected = radiance() / frozen_room().surfels.albedo.double().numpy()
    np.testing.assert_allclose(albedo, expected, rtol=1e-3)  # 2e-4


def test_without_any_unseen_nothing_comes_back() -> None:
    everything = np.ones(radiance().shape, dtype=bool)
    received = Received.of(gather(), radiance(), everything, radiance())
    np.testing.assert_array_equal(received.known, gather() @ radiance())


def test_derivatives_are_those_of_finite_differences() -> None:
    made = problem()
    lamps = made.lamps(true_lamps(made).places + 0.02, true_lamps(made).logs + 0.1)
    exact, step = made.jacobian(lamps), 1e-3
    for number in range(exact.shape[2]):
        lamp, own = divmod(number, 6)
        moved = []
        for sign in (-1.0, 1.0):
            places, logs = lamps.places.copy(), lamps.logs.copy()
            if own < 3:
                places[lamp, own] += sign * step * made.size
            else:
                logs[lamp, own - 3] += sign * step
            moved.append(np.log(made.arriving(made.lamps(places, logs))))
        difference = (moved[1] - moved[0]) / (2.0 * step)
        off = np.abs(difference - exact[:, :, number].T)
        # Where an edge of shadow lies between the two places, differences see the other side of it.
        assert np.quantile(off, 0.9) < 0.02 * np.abs(exact[:, :, number]).max()  # 0.006


def test_true_lamps_leave_nothing_but_the_paint() -> None:
    made = problem()
    left = made.residual(true_lamps(made)) - np.log(frozen_room().surfels.albedo.double().numpy() / 0.5)
    assert np.abs(left[~unseen()]).max() < 1e-3  # 7e-5


def test_lamps_are_found_from_nearby() -> None:
    made = problem()
    start = made.lamps(true_lamps(made).places + 0.05, true_lamps(made).logs - 0.2)
    found = made.refined(start, 30)
    assert made.cost(found) < 0.1 * made.cost(start)
    assert np.linalg.norm(found.places - true_lamps(made).places, axis=1).max() < 0.003  # 5e-4 of the room
