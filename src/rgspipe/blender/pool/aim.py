"""Where spots are aimed: at what the first camera sees, or at what hands their light on to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import torch

from rgspipe.blender.targets import PROBES, SURFACE_OFFSET
from rgspipe.scene import Camera
from rgspipe.scene.lights import AxialLight
from rgspipe.scene.lights.angles import angle_from_axis

if TYPE_CHECKING:
    from rgspipe.blender.geometry import Geometry

#: Axes that are tried for one position.
MAX_AXES = 50

#: Least share of what the first camera sees that lies in the light of a spot, inside half its intensity. Where a point
#: light would reach less, all that it reaches.
MIN_SPOT_SHARE = 0.05

#: Least share of what the first camera sees that sees the place that a spot around the corner is aimed at.
MIN_RELAY_SHARE = 0.15


def seen_points(camera: Camera, geometry: Geometry) -> np.ndarray:
    """(P, 3) surface points behind a regular grid of PROBES × PROBES pixels, a hair before the surface."""
    step = (torch.arange(PROBES, dtype=torch.float64) + 0.5) / PROBES
    rows, columns = (step * camera.height).long(), (step * camera.width).long()
    _, directions, _ = camera.rays((rows[:, None] * camera.width + columns).reshape(-1))
    origin = camera.origin.numpy()
    distances = [geometry.cast(origin, direction)[0] for direction in directions.numpy()]
    points = [origin + d * (t - SURFACE_OFFSET) for d, t in zip(directions.numpy(), distances, strict=True)]
    return np.array(points)[np.isfinite(distances)]


def aim_at_seen(
    rng: np.random.Generator, position: np.ndarray, shape: AxialLight, seen: np.ndarray, geometry: Geometry
) -> np.ndarray | None:
    """(3,) a unit axis from `position` (3,) to one of the points `seen` (P, 3) in its reach that lights enough of them.

    None if `MAX_AXES` draws find none.
    """
    lit = seen[[not geometry.blocked(position, point) for point in seen]]
    least = min(MIN_SPOT_SHARE * len(seen), len(lit))
    towards = torch.from_numpy(lit - position)
    for _ in range(MAX_AXES if len(lit) else 0):
        axis = towards[rng.integers(len(lit))]
        if int((shape.relative_intensity_at(angle_from_axis(axis, towards)) >= 0.5).sum()) >= least:
            return _unit(axis.numpy())
    return None


def aim_at_relay(
    rng: np.random.Generator, position: np.ndarray, seen: np.ndarray, geometry: Geometry
) -> np.ndarray | None:
    """(3,) a unit axis from `position` (3,) to a place on a surface that is in sight of enough of the points `seen`.

    None if `MAX_AXES` draws find none.
    """
    for _ in range(MAX_AXES if len(seen) else 0):
        axis = _unit(rng.normal(size=3))
        distance, _ = geometry.cast(position, axis)
        if not np.isfinite(distance):
            continue
        relay = position + axis * (distance - SURFACE_OFFSET)
        if np.mean([not geometry.blocked(relay, point) for point in seen]) >= MIN_RELAY_SHARE:
            return axis
    return None


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
