"""The problem of finding the lamps of a painted room, of which a part is unseen and all else is known exactly."""

from __future__ import annotations

from functools import cache

import numpy as np
import torch

from photographed_room import LAMPS, frozen_room
from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.received import Received
from rgspipe.capture.receivers import Receivers


@cache
def gather() -> np.ndarray:
    return frozen_room().gather.to_scipy().astype(np.float64).tocsr()


@cache
def radiance() -> np.ndarray:
    """All bounces of what the lamps send, by the whole gather operator."""
    surfels = frozen_room().surfels
    with torch.no_grad():
        sent, _ = frozen_room().unit_irradiance(torch.stack([lamp.position for lamp in LAMPS]))
    intensity = np.stack([lamp.intensity.numpy() for lamp in LAMPS]) / np.pi
    direct = sent.double().numpy().T @ intensity
    albedo, found = surfels.albedo.double().numpy(), 0.0
    for _ in range(60):
        found = albedo * (direct + gather() @ (found if np.ndim(found) else np.zeros_like(direct)))
    return found


def unseen() -> np.ndarray:
    """The box and the floor behind it, as if no camera had seen them."""
    centers = frozen_room().surfels.centers.numpy()
    return (centers[:, 0] > 0.05) & (centers[:, 2] < -0.1)


def in_all_channels(seen: np.ndarray) -> np.ndarray:
    """(N, 3) of (N,)."""
    return np.repeat(seen[:, None], 3, axis=1)


@cache
def problem() -> LampProblem:
    frozen = frozen_room()
    albedo = frozen.surfels.albedo.double().numpy()
    received = Received.of(gather(), radiance(), in_all_channels(~unseen()), albedo)
    grey = np.full_like(albedo, 0.5)
    measured = np.where(unseen(), np.inf, 1e-4)
    field = Field(Graph.of(frozen.surfels, grey), measured, (~unseen()).astype(np.float64), Variances())
    return LampProblem(Receivers(frozen), received, field, radiance(), grey, measured, 256)


def true_lamps(problem: LampProblem) -> Lamps:
    places = np.stack([lamp.position.numpy() for lamp in LAMPS])
    return problem.lamps(places, np.log(np.stack([lamp.intensity.numpy() for lamp in LAMPS]) / np.pi))
