"""Light that comes back from what no camera saw, where much of it does."""

from __future__ import annotations

import numpy as np
import pytest

from lamp_problem import gather, radiance
from photographed_room import frozen_room
from rgspipe.capture.received import Received


def half_unseen(albedo: float) -> Received:
    """The room with all that is to the left unseen, in one albedo."""
    centers = frozen_room().surfels.centers.numpy()
    seen = np.repeat(centers[:, :1] > 0.0, 3, axis=1)
    return Received.of(gather(), radiance(), seen, np.full(seen.shape, albedo))


def light(received: Received) -> np.ndarray:
    """(N, 2) of a lamp near what was not seen, and of one far from it, unshadowed."""
    centers = frozen_room().surfels.centers.double().numpy()
    return np.stack([1.0 / (0.1 + ((centers - place) ** 2).sum(axis=1)) for place in ([-0.3, 0, 0], [0.3, 0, 0])], 1)


@pytest.mark.parametrize(("albedo", "off"), [(0.3, 1e-5), (0.9, 5e-3), (0.98, 8e-3)])
def test_light_that_comes_back_is_that_of_all_bounces(albedo: float, off: float) -> None:
    """Measured: 4e-6, 3e-3 and 6e-3 at most, in the median 2e-4; eight bounces alone are 6e-7, 0.025 and 0.055 off."""
    received = half_unseen(albedo)
    first, unseen = light(received), received.unseen
    among, sent = gather()[unseen][:, unseen], albedo * first[unseen]
    for _ in range(1000):
        sent = albedo * (first[unseen] + among @ sent)
    expected = first + gather()[:, unseen] @ sent
    for channel in (0, None):
        np.testing.assert_allclose(received.spread(first, channel), expected, rtol=off)


def test_black_surfaces_send_nothing_back() -> None:
    received = half_unseen(0.0)
    np.testing.assert_array_equal(received.spread(light(received)), light(received))


def test_a_prediction_beyond_what_surfaces_reflect_is_no_light_without_end() -> None:
    """Albedo maps are known up to a scale."""
    np.testing.assert_array_equal(half_unseen(3.0).known, half_unseen(0.98).known)


def test_channels_that_are_told_after_all_are_measured_as_if_they_always_had_been() -> None:
    """Which bounds count is asked anew for each round of lamps, and cuts no operators out of the whole again."""
    right = frozen_room().surfels.centers.numpy()[:, :1]
    told = (right > 0.2) | (right > 0.0) & np.array([True, False, False])
    albedo = np.full(told.shape, 0.6)
    few = Received.of(gather(), radiance(), np.repeat(right > 0.2, 3, axis=1), albedo)
    expected = Received.of(gather(), radiance(), told, albedo)
    assert np.abs(few.known / expected.known - 1.0).max() > 0.01
    np.testing.assert_allclose(few.with_told(told, albedo).known, expected.known, rtol=1e-6)


def test_another_albedo_is_taken_throughout() -> None:
    received = half_unseen(0.9).with_albedo(np.full(radiance().shape, 0.3))
    np.testing.assert_array_equal(received.known, half_unseen(0.3).known)
