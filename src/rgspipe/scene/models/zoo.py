"""Rooms that nobody tuned: plan, furniture and colours are drawn from a seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rgspipe.scene.models.box import Box, Vector
from rgspipe.scene.models.floor_plan import FloorPlan

Outline = tuple[tuple[float, float], ...]

#: Numbers of the random streams; part of the seed, so never renumber them.
STREAMS = {"plan": 0, "furniture": 1, "colours": 2, "views": 3, "targets": 4}

#: Darkest and brightest albedo of each tone, and the largest saturation.
TONES = {"white": (0.85, 0.95, 0.05), "dark": (0.02, 0.3, 0.8), "mixed": (0.1, 0.9, 0.8)}

#: Draws after which a piece of furniture that finds no place is left out.
TRIES = 200

#: Thickness of a wall between two rooms, scene units.
PARTITION = 0.03

#: What surfaces may look like besides one colour.
PATTERNS = ("checker", "stripes", "mottled")


@dataclass(frozen=True)
class Finish:
    """The look of a surface.

    Attributes:
        albedo: diffuse reflectance RGB.
        other: a second one, where there is a pattern.
        pattern: one of PATTERNS; None for one colour.
        size: of the pattern's parts, scene units.
    """

    albedo: Vector
    other: Vector
    pattern: str | None
    size: float


@dataclass(frozen=True)
class RoundThing:
    """A ball or an upright drum.

    Attributes:
        kind: "ball" or "drum".
        center: the middle of a ball, of a drum that of its foot; scene units.
        radius, height: scene units; the height of a ball is twice its radius.
    """

    kind: str
    center: Vector
    radius: float
    height: float


@dataclass(frozen=True)
class ZooRoom:
    """A room and what stands in it, in the unit cube.

    Attributes:
        seed: what it was drawn from.
        plan: floor, ceiling and walls.
        open_wall: index of a wall that is not there; None if the room is closed.
        boxes: furniture, and walls between rooms.
        round_things: furniture that is not flat.
        finishes: of the walls in their order, the floor, the ceiling, the boxes and the round things.
    """

    seed: int
    plan: FloorPlan
    open_wall: int | None
    boxes: tuple[Box, ...]
    round_things: tuple[RoundThing, ...]
    finishes: tuple[Finish, ...]


def draw_room(seed: int, plan: str = "any", tone: str = "any", fronts: str = "any") -> ZooRoom:
    """The room of a seed.

    Args:
        plan: one of PLANS; "any" draws it.
        tone: one of TONES; "any" draws it.
        fronts: "closed" or "open"; "any" draws it. Only rooms of one part can be open.
    """
    rng = np.random.default_rng([seed, STREAMS["plan"]])
    drawn = str(rng.choice(list(PLANS)))
    plan = drawn if plan == "any" else plan
    width, depth, height = 1.0, rng.uniform(0.6, 1.0), rng.uniform(0.4, 0.8)
    outline, partitions = PLANS[plan](rng, width, depth, height)
    is_open = rng.random() < 0.3 if fronts == "any" else fronts == "open"
    open_wall = 0 if is_open and plan in ("box", "alcove") else None
    furniture = np.random.default_rng([seed, STREAMS["furniture"]])
    boxes, round_things = _furniture(furniture, outline, height, partitions)
    count = len(outline) + 2 + len(boxes) + len(round_things)
    finishes = _finishes(np.random.default_rng([seed, STREAMS["colours"]]), tone, count)
    plain = [finish.albedo for finish in finishes]
    floor_plan = FloorPlan(outline, height, tuple(plain[: len(outline)]), plain[len(outline)], plain[len(outline) + 1])
    return ZooRoom(seed, floor_plan, open_wall, boxes, round_things, finishes)


def _box(rng: np.random.Generator, width: float, depth: float, height: float) -> tuple[Outline, tuple[Box, ...]]:
    a, b = 0.5 * width, 0.5 * depth
    return ((-a, -b), (a, -b), (a, b), (-a, b)), ()


def _l_shape(rng: np.random.Generator, width: float, depth: float, height: float) -> tuple[Outline, tuple[Box, ...]]:
    """A box without its corner at the back right."""
    a, b = 0.5 * width, 0.5 * depth
    x, y = a - width * rng.uniform(0.35, 0.55), b - depth * rng.uniform(0.35, 0.55)
    return ((-a, -b), (a, -b), (a, y), (x, y), (x, b), (-a, b)), ()


def _t_shape(rng: np.random.Generator, width: float, depth: float, height: float) -> tuple[Outline, tuple[Box, ...]]:
    """A box without its two corners at the back."""
    a, b = 0.5 * width, 0.5 * depth
    left, right = -a + width * rng.uniform(0.2, 0.35), a - width * rng.uniform(0.2, 0.35)
    y = b - depth * rng.uniform(0.35, 0.5)
    return ((-a, -b), (a, -b), (a, y), (right, y), (right, b), (left, b), (left, y), (-a, y)), ()


def _alcove(rng: np.random.Generator, width: float, depth: float, height: float) -> tuple[Outline, tuple[Box, ...]]:
    """A box with a niche in the wall on the right."""
    a, b = 0.5 * width, 0.5 * depth
    x, low = a - width * rng.uniform(0.12, 0.25), -b + depth * rng.uniform(0.25, 0.4)
    high = low + depth * rng.uniform(0.25, 0.35)
    return ((-a, -b), (x, -b), (x, low), (a, low), (a, high), (x, high), (x, b), (-a, b)), ()


def _two_rooms(rng: np.random.Generator, width: float, depth: float, height: float) -> tuple[Outline, tuple[Box, ...]]:
    """A box with a wall across it, and a door in that."""
    outline, _ = _box(rng, width, depth, height)
    x, door, top = rng.uniform(-0.1, 0.25) * width, rng.uniform(0.2, 0.3) * depth, rng.uniform(0.65, 0.85) * height
    low = -0.5 * depth + rng.uniform(0.15, 0.85 - door / depth) * depth
    high = low + door
    parts = [(-0.5 * depth, low, 0.0, height), (high, 0.5 * depth, 0.0, height), (low, high, top, height)]
    walls = tuple(
        Box((x, 0.5 * (y0 + y1), 0.5 * (z0 + z1) - 0.5 * height), (PARTITION, y1 - y0, z1 - z0), 0.0)
        for y0, y1, z0, z1 in parts
    )
    return outline, walls


#: The plans of rooms: from a stream, width, depth and height to the outline and the walls that stand inside it.
PLANS: dict[str, Callable[..., tuple[Outline, tuple[Box, ...]]]] = {
    "box": _box,
    "l": _l_shape,
    "t": _t_shape,
    "alcove": _alcove,
    "two_rooms": _two_rooms,
}


def _furniture(
    rng: np.random.Generator, outline: Outline, height: float, partitions: tuple[Box, ...]
) -> tuple[tuple[Box, ...], tuple[RoundThing, ...]]:
    """What stands on the floor, none of it in another or in a wall."""
    taken: list[tuple[float, float, float]] = []
    boxes, round_things = list(partitions), []
    for _ in range(rng.integers(1, 7)):
        size = (rng.uniform(0.06, 0.3), rng.uniform(0.06, 0.3), height * rng.uniform(0.12, 0.8))
        radius, turn = 0.5 * math.hypot(size[0], size[1]), rng.uniform(0.0, math.pi)
        if (place := _place(rng, outline, partitions, taken, radius)) is not None:
            boxes.append(Box((*place, 0.5 * (size[2] - height)), size, turn))
    for _ in range(rng.integers(0, 4)):
        kind, radius = str(rng.choice(["ball", "drum"])), rng.uniform(0.03, 0.1)
        tall = 2.0 * radius if kind == "ball" else height * rng.uniform(0.1, 0.6)
        if (place := _place(rng, outline, partitions, taken, radius)) is not None:
            rise = radius if kind == "ball" else 0.0
            round_things.append(RoundThing(kind, (*place, rise - 0.5 * height), radius, tall))
    return tuple(boxes), tuple(round_things)


def _place(
    rng: np.random.Generator,
    outline: Outline,
    partitions: tuple[Box, ...],
    taken: list[tuple[float, float, float]],
    radius: float,
) -> tuple[float, float] | None:
    """x and y of a free circle of the floor, which is then taken; None if none is found."""
    for _ in range(TRIES):
        x, y = rng.uniform(-0.5, 0.5, 2)
        clear = all(math.hypot(x - u, y - v) > radius + other + 0.02 for u, v, other in taken)
        apart = all(abs(x - wall.center[0]) > radius + PARTITION for wall in partitions)
        if clear and apart and inside(outline, x, y) and wall_distance(outline, x, y) > radius:
            taken.append((x, y, radius))
            return float(x), float(y)
    return None


def inside(outline: Outline, x: float, y: float) -> bool:
    """Whether a point lies within an outline, by the parity of the sides to its right."""
    sides = zip(outline, (*outline[1:], outline[0]), strict=True)
    crossed = [(u, v, p, q) for (u, v), (p, q) in sides if (v > y) != (q > y)]
    return sum(u + (y - v) * (p - u) / (q - v) > x for u, v, p, q in crossed) % 2 == 1


def wall_distance(outline: Outline, x: float, y: float) -> float:
    """Distance of a point from the nearest side of an outline."""
    found = []
    for (u, v), (p, q) in zip(outline, (*outline[1:], outline[0]), strict=True):
        along = ((x - u) * (p - u) + (y - v) * (q - v)) / ((p - u) ** 2 + (q - v) ** 2)
        along = min(max(along, 0.0), 1.0)
        found.append(math.hypot(x - u - along * (p - u), y - v - along * (q - v)))
    return min(found)


def _finishes(rng: np.random.Generator, tone: str, count: int) -> tuple[Finish, ...]:
    drawn = str(rng.choice(list(TONES), p=[0.25, 0.15, 0.6]))
    low, high, saturation = TONES[drawn if tone == "any" else tone]
    return tuple(_finish(rng, low, high, saturation) for _ in range(count))


def _finish(rng: np.random.Generator, low: float, high: float, saturation: float) -> Finish:
    colours = [_colour(rng, low, high, saturation) for _ in range(2)]
    pattern = str(rng.choice(PATTERNS)) if rng.random() < 0.25 else None
    return Finish(*colours, pattern, rng.uniform(0.05, 0.2))


def _colour(rng: np.random.Generator, low: float, high: float, saturation: float) -> Vector:
    """A colour whose brightest channel lies between `low` and `high`; most are pale."""
    bright, pure = rng.uniform(low, high), saturation * rng.random() ** 2
    channels = 1.0 - pure * rng.permutation([0.0, rng.random(), 1.0])
    return tuple(float(max(low, bright * channel)) for channel in channels)
