"""Rooms that are drawn from a seed: always the same, with furniture that stands on the floor and in nothing else."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.scene.models import Box
from rgspipe.scene.models.zoo import PARTITION, PLANS, TONES, ZooRoom, draw_room, inside

SEEDS = st.integers(0, 2**31 - 1)


def furniture(room: ZooRoom) -> list[Box]:
    return [box for box in room.boxes if box.size[0] != PARTITION]


@settings(deadline=None, max_examples=60)
@given(SEEDS)
def test_furniture_stands_inside_and_apart(seed: int) -> None:
    room = draw_room(seed)
    outline, floor = room.plan.outline, -0.5 * room.plan.height
    feet = [(box.center[0], box.center[1], 0.5 * math.hypot(*box.size[:2])) for box in furniture(room)]
    feet += [(*thing.center[:2], thing.radius) for thing in room.round_things]
    for x, y, radius in feet:
        around = [(x + radius * math.cos(t), y + radius * math.sin(t)) for t in np.linspace(0.0, 2.0 * math.pi, 50)]
        assert all(inside(outline, u, v) for u, v in around)
    assert all(math.hypot(a[0] - b[0], a[1] - b[1]) > a[2] + b[2] for a, b in combinations(feet, 2))
    for box in furniture(room):
        assert box.center[2] - 0.5 * box.size[2] == pytest.approx(floor)
        assert box.size[2] < room.plan.height


@settings(deadline=None, max_examples=60)
@given(SEEDS)
def test_it_lies_in_the_unit_cube_and_every_surface_has_a_colour_of_its_tone(seed: int) -> None:
    room = draw_room(seed, tone="dark")
    assert all(max(abs(x), abs(y)) <= 0.5 for x, y in room.plan.outline) and 0.4 <= room.plan.height <= 0.8
    assert len(room.finishes) == len(room.plan.outline) + 2 + len(room.boxes) + len(room.round_things)
    low, high, _ = TONES["dark"]
    assert all(low <= c <= high for finish in room.finishes for c in (*finish.albedo, *finish.other))


@pytest.mark.parametrize("plan", PLANS)
def test_a_plan_may_be_chosen_and_the_same_seed_gives_the_same_room(plan: str) -> None:
    room = draw_room(5, plan)
    assert room == draw_room(5, plan) and room != draw_room(6, plan)
    assert len(room.plan.outline) == {"box": 4, "two_rooms": 4, "l": 6, "t": 8, "alcove": 8}[plan]
    assert sum(box.size[0] == PARTITION for box in room.boxes) == (3 if plan == "two_rooms" else 0)


def test_outlines_run_counter_clockwise_so_that_walls_face_inwards() -> None:
    for plan in PLANS:
        outline = draw_room(1, plan).plan.outline
        area = sum(x * v - u * y for (x, y), (u, v) in zip(outline, (*outline[1:], outline[0]), strict=True))
        assert area > 0.0


@pytest.mark.parametrize(("plan", "wall"), [("box", 0), ("alcove", 0), ("l", None), ("two_rooms", None)])
def test_only_rooms_of_one_part_can_be_open(plan: str, wall: int | None) -> None:
    assert draw_room(3, plan, fronts="open").open_wall == wall
    assert draw_room(3, plan, fronts="closed").open_wall is None
