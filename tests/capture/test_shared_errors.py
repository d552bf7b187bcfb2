"""Errors that a whole part of a scene shares, of a room that is seen as a whole and lit by known lamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photographed_room import LAMPS, frozen_room, radiance_under
from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.lamps import LampProblem
from rgspipe.capture.received import Received
from rgspipe.capture.receivers import Receivers
from rgspipe.capture.shared_errors import shared_covariance


def problem(noise: float) -> LampProblem:
    """Of which lamps and paint leave `noise` of the logarithm unexplained."""
    frozen = replace(frozen_room(), candidates=None).with_dictionary(3)
    albedo = frozen.surfels.albedo.double().numpy()
    radiance, everything = radiance_under(LAMPS).double().numpy(), np.ones(albedo.shape, dtype=bool)
    received = Received.of(frozen.gather.to_scipy().astype(np.float64).tocsr(), radiance, everything, albedo)
    measured = np.full(len(albedo), 1e-4)
    variances = Variances(noise=noise**2)
    field = Field(Graph.of(frozen.surfels, albedo), measured, np.ones(len(albedo)), variances)
    return LampProblem(Receivers(frozen), received, field, radiance, albedo, measured, 256)


@pytest.mark.parametrize(("noise", "low", "high"), [(0.0, 0.0, 1e-9), (0.02, 1e-4, 5e-3), (0.3, 5e-3, 0.2)])
def test_what_is_not_explained_may_be_the_light_of_another_lamp(noise: float, low: float, high: float) -> None:
    made = problem(noise)
    lamps = made.lamps(
        np.stack([lamp.position.numpy() for lamp in LAMPS]),
        np.log(np.stack([lamp.intensity.numpy() for lamp in LAMPS]) / np.pi),
    )
    covariance = shared_covariance(made, lamps)
    spread = np.sqrt(np.diagonal(covariance).reshape(2, 6)[:, :3].sum(axis=1))
    # 0, 0.002 to 0.003, and 0.05 to 0.07 of the room.
    assert (low <= spread).all() and (spread <= high).all()
