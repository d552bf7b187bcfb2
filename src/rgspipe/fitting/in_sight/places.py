"""Where lamps in sight may stand: along the ray through each, and where rays of several views meet."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import torch
from torch import Tensor

from rgspipe.fitting.in_sight.lamp import BESIDE, LampInSight, grown
from rgspipe.fitting.in_sight.sight import Numbers, Sight

#: Places on a ray, evenly spread between the camera and the surface behind the lamp.
ON_RAY = 12


def places(views: Sequence[Sight], lamps: Sequence[LampInSight], passing: float) -> Tensor:
    """(K, 3) float32 where lights may stand that these are the images of.

    Args:
        passing: rays of two views that pass each other by less than this are of one lamp, scene units.
    """
    rays = [_Ray(lamp.view, *_ray(views[lamp.view], lamp)) for lamp in lamps]
    found = [ray.origin + share * ray.reach * ray.direction for ray in rays for share in _shares()]
    for one, other in combinations(rays, 2):
        if one.view != other.view and (meeting := _meeting(one, other, passing)) is not None:
            found.append(meeting)
    return torch.from_numpy(np.array(found).reshape(-1, 3)).float()


def _shares() -> Numbers:
    return (np.arange(ON_RAY) + 0.5) / ON_RAY


class _Ray:
    """From a camera through the middle of a lamp to the surface behind it."""

    def __init__(self, view: int, origin: Numbers, direction: Numbers, reach: float) -> None:
        self.view, self.origin, self.direction, self.reach = view, origin, direction, reach


def _ray(sight: Sight, lamp: LampInSight) -> tuple[Numbers, Numbers, float]:
    column, row = lamp.place
    camera = sight.camera
    local = np.array([(column - camera.cx) / camera.fx, -(row - camera.cy) / camera.fy, -1.0])
    direction = camera.camera_to_world[:3, :3].numpy() @ (local / np.linalg.norm(local))
    near = grown(lamp.core, BESIDE) & sight.surface
    reach = float(np.median(sight.distance[near])) if near.any() else float(np.median(sight.distance))
    return camera.origin.numpy(), direction, reach


def _meeting(one: _Ray, other: _Ray, passing: float) -> Numbers | None:
    """The middle between two rays where they are closest; None where that is far, or behind a camera."""
    between = other.origin - one.origin
    cosine = float(one.direction @ other.direction)
    apart = 1.0 - cosine**2
    if apart < 1e-6:
        return None
    along = float(between @ (one.direction - cosine * other.direction)) / apart
    beside = float(between @ (cosine * one.direction - other.direction)) / apart
    first, second = one.origin + along * one.direction, other.origin + beside * other.direction
    met = along > 0.0 and beside > 0.0 and float(np.linalg.norm(first - second)) < passing
    return 0.5 * (first + second) if met else None
