"""Rooms of the zoo as a study sees them: how each is photographed, and what it is like."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.scene import Camera
from rgspipe.scene.models.zoo import PARTITION, TONES, Finish, ZooRoom
from rgspipe.scene.surfels import Surfels

#: Number of the random stream of numbers of views and noise, beside those of `scene.models.zoo`; never renumber it.
STREAM = 5

#: The part of a room's depth in which all cameras are that photograph it from one side.
SIDE = 0.16

#: Rooms with odd seeds may be looked at while the program is worked on; those with even ones only at the end.
WORK, FINAL = "work", "final"


def part_of(seed: int) -> str:
    """What a room is for: `WORK` or `FINAL`."""
    return WORK if seed % 2 else FINAL


def photographed(seed: int, views: tuple[int, int], noise: tuple[float, float]) -> tuple[int, float]:
    """Number of training views and relative noise of a room, each evenly within its range, ends included.

    Another range of views is another draw of the noise, too.
    """
    rng = np.random.default_rng([seed, STREAM])
    return int(rng.integers(views[0], views[1] + 1)), round(float(rng.uniform(*noise)), 4)


def room_properties(room: ZooRoom) -> dict[str, Any]:
    """What a room is like: `plan`, `tone`, mean `albedo`, `fronts` and `pieces` of furniture."""
    return {
        "plan": plan_of(room),
        "tone": tone_of(room),
        "albedo": mean_albedo(room),
        "fronts": "closed" if room.open_wall is None else "open",
        "pieces": sum(box.size[0] != PARTITION for box in room.boxes) + len(room.round_things),
    }


def plan_of(room: ZooRoom) -> str:
    """One of `PLANS`, by the corners of the floor and the walls inside."""
    outline = room.plan.outline
    if len(outline) == 4:
        return "two_rooms" if any(box.size[0] == PARTITION for box in room.boxes) else "box"
    if len(outline) == 6:
        return "l"
    # The front of a T is as wide as the room, that of a room with a niche is not.
    return "t" if outline[1][0] == max(x for x, _ in outline) else "alcove"


def tone_of(room: ZooRoom) -> str:
    """The narrowest of `TONES` that all colours of the room belong to."""
    values = np.array([max(colour) for finish in room.finishes for colour in (finish.albedo, finish.other)])
    fits = [name for name, (low, high, _) in TONES.items() if low <= values.min() and values.max() <= high]
    return min(fits, key=lambda name: TONES[name][1] - TONES[name][0], default="mixed")


def mean_albedo(room: ZooRoom) -> float:
    """Mean reflectance of walls, floor and ceiling by area, over all channels."""
    corners = np.array(room.plan.outline)
    following = np.roll(corners, -1, axis=0)
    walls = np.linalg.norm(following - corners, axis=1) * room.plan.height
    if room.open_wall is not None:
        walls[room.open_wall] = 0.0
    floor = 0.5 * abs(float(np.sum(corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1])))
    areas = np.array([*walls, floor, floor])
    return float(np.average([_mean(finish) for finish in room.finishes[: len(areas)]], weights=areas))


def _mean(finish: Finish) -> float:
    colours = (finish.albedo, finish.other) if finish.pattern else (finish.albedo,)
    return float(np.mean(colours))


def camera_properties(room: ZooRoom, cameras: Sequence[Camera]) -> dict[str, Any]:
    """How a room was photographed: mean field of view `lens`, degrees, and `stand`, "one side" or "among"."""
    fields = [2.0 * np.arctan(0.5 * camera.width / camera.fx) for camera in cameras]
    depths = [y for _, y in room.plan.outline]
    farthest = max(float(camera.origin[1]) for camera in cameras)
    aside = farthest - min(depths) < SIDE * (max(depths) - min(depths))
    return {"lens": float(np.degrees(np.mean(fields))), "stand": "one side" if aside else "among"}


def share_unseen(surfels: Surfels) -> float:
    """Part of the surfels' area that no camera saw."""
    areas = to_array(surfels.scales).prod(axis=1) * to_array(surfels.opacities)
    return _share(areas, surfels.guessed)


def _share(areas: npt.NDArray, guessed: ArrayLike) -> float:
    return float(areas[to_array(guessed) > 0.0].sum() / areas.sum())
