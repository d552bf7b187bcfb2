"""The ways of a spot that sweeps over a scene: it turns at its place, or goes around the scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.scene import SpotLight
from rgspipe.scene.lights.angles import angle_from_axis

#: Two axes are different, and turn into each other in one way, where the angle between them is this far from 0 and π.
LEAST_TURN = 1e-3

#: Where a spot turns in a room: its height, and the height of what it is aimed at, over that of the room.
ROOM_PLACE, ROOM_AIM = 0.9, 0.3

#: The circle in a room: its radius over the shorter side of the floor, its height above the middle over the room's.
ROOM_RADIUS, ROOM_HEIGHT = 0.3, 0.35

#: Around an object, in radii of its bounding sphere: how high a spot turns above the middle, and how wide and high it
#: goes around.
OBJECT_PLACE, OBJECT_RADIUS, OBJECT_HEIGHT = 2.0, 1.6, 1.2


@dataclass(frozen=True)
class SpotKind:
    """The spot of a sweep.

    Attributes:
        shape: a spot of its profile, wherever it is.
        intensity: (3,) W/sr on the axis.
    """

    shape: SpotLight
    intensity: Tensor

    def light(self, position: Tensor, direction: Tensor) -> SpotLight:
        """The spot at `position` (3,), along `direction` (3,) of any length but zero."""
        axis = torch.nn.functional.normalize(direction.double(), dim=0)
        return self.shape.at(position.double(), axis, self.intensity)


@dataclass(frozen=True)
class SweepPlaces:
    """Where the sweeps of a scene go. All are (3,) float64, scene units.

    Attributes:
        position: place of a spot that turns.
        start, end: what it is aimed at first and last.
        center: what a spot that goes around is aimed at.
        radius, height: of its circle, the height over `center`.
    """

    position: Tensor
    start: Tensor
    end: Tensor
    center: Tensor
    radius: float
    height: float


def default_places(bounds: tuple[Tensor, Tensor], is_open: bool, across: int = 0) -> SweepPlaces:
    """Where sweeps go if nothing is said.

    In a closed scene the spot turns under the middle of the ceiling, and its circle lies in the upper part of the
    room. Around an open scene both are outside.

    Args:
        bounds: (3,) lower and upper corner of the scene, z up.
        is_open: whether the scene is an object in empty space.
        across: horizontal axis, 0 or 1, along which the axis of a spot that turns sweeps.
    """
    lower, upper = (corner.double().cpu() for corner in bounds)
    middle, sides = 0.5 * (lower + upper), upper - lower
    position, start = middle.clone(), middle.clone()
    start[2] = lower[2] + ROOM_AIM * sides[2]
    end = start.clone()
    start[across], end[across] = lower[across], upper[across]
    if is_open:
        size = 0.5 * float(sides.norm())
        position[2] = middle[2] + OBJECT_PLACE * size
        return SweepPlaces(position, start, end, middle, OBJECT_RADIUS * size, OBJECT_HEIGHT * size)
    position[2] = lower[2] + ROOM_PLACE * sides[2]
    radius, height = ROOM_RADIUS * float(sides[:2].amin()), ROOM_HEIGHT * float(sides[2])
    return SweepPlaces(position, start, end, middle, radius, height)


def aim_sweep(position: Tensor, start: Tensor, end: Tensor, frames: int, spot: SpotKind) -> list[SpotLight]:
    """A spot at `position` (3,) whose axis turns evenly, along a great circle, from the point `start` to `end`.

    Raises:
        ValueError: the light stands on one of the points, the points lie in one direction, or in opposite ones.
    """
    origin, first, last = (point.double() for point in (position, start, end))
    if min(float((point - origin).norm()) for point in (first, last)) == 0.0:
        raise ValueError("the spot stands on a point that it is aimed at")
    first, last = (torch.nn.functional.normalize(point - origin, dim=0) for point in (first, last))
    angle = float(angle_from_axis(first, last))
    if not LEAST_TURN < angle < math.pi - LEAST_TURN:
        raise ValueError("the points lie in one direction from the spot, or in opposite ones")
    side = torch.nn.functional.normalize(last - math.cos(angle) * first, dim=0)
    turns = torch.linspace(0.0, angle, frames, dtype=torch.float64).tolist()
    return [spot.light(origin, math.cos(turn) * first + math.sin(turn) * side) for turn in turns]


def orbit_sweep(center: Tensor, radius: float, height: float, frames: int, spot: SpotKind) -> list[SpotLight]:
    """A spot that goes once around the vertical through `center` (3,), `height` above it, aimed at it.

    The last frame is one step before the first, so that a video goes round and round.

    Raises:
        ValueError: the circle has no radius.
    """
    if not radius > 0.0:
        raise ValueError(f"the circle of a spot needs a radius above 0, got {radius:g}")
    lights = []
    for frame in range(frames):
        turn = 2.0 * math.pi * frame / frames
        offset = torch.tensor([radius * math.cos(turn), radius * math.sin(turn), height], dtype=torch.float64)
        lights.append(spot.light(center.double() + offset, -offset))
    return lights


def spread_frames(count: int, wanted: int, *, closed: bool = False) -> list[int]:
    """Indices of at most `wanted` of `count` frames, evenly spread.

    With the first and the last, or, of a way that is `closed`, without the last, which is much like the first.
    """
    places = torch.linspace(0, count if closed else count - 1, min(count, wanted) + closed, dtype=torch.float64)
    return places[: min(count, wanted)].round().long().unique().tolist()


def there_and_back(frames: Sequence) -> list:
    """The frames of a way and of its way back, as a video that repeats plays them."""
    return [*frames, *frames[-2:0:-1]]
