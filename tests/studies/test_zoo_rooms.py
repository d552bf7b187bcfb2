"""What a study says of rooms: told from what was drawn, and from cameras and surfels."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from lit_room import room_surfels
from rgspipe.scene import Camera, look_at
from rgspipe.scene.models.zoo import PLANS, TONES, draw_room
from rgspipe.studies.zoo_rooms import (
    FINAL,
    WORK,
    camera_properties,
    mean_albedo,
    part_of,
    photographed,
    plan_of,
    room_properties,
    share_unseen,
    tone_of,
)


@pytest.mark.parametrize("plan", PLANS)
def test_plans_are_told_from_each_other(plan: str) -> None:
    assert all(plan_of(draw_room(seed, plan)) == plan for seed in range(60))


@pytest.mark.parametrize("tone", TONES)
def test_tones_are_told_from_each_other(tone: str) -> None:
    assert all(tone_of(draw_room(seed, tone=tone)) == tone for seed in range(60))


def test_numbers_of_views_and_noise_fill_their_ranges_and_belong_to_the_seed() -> None:
    drawn = [photographed(seed, (25, 100), (0.0, 0.1)) for seed in range(2000)]
    assert {views for views, _ in drawn} == set(range(25, 101))
    noise = [value for _, value in drawn]
    # Measured: 0.0000, 0.1000 and 0.0497; an even draw has a mean of 0.05 ± 0.0006.
    assert 0.0 <= min(noise) < 0.001 and 0.099 < max(noise) <= 0.1 and abs(sum(noise) / 2000 - 0.05) < 0.002
    assert drawn[7] == photographed(7, (25, 100), (0.0, 0.1)) != drawn[8]
    assert photographed(7, (40, 40), (0.0, 0.0)) == (40, 0.0)


def test_odd_seeds_are_for_work() -> None:
    assert [part_of(seed) for seed in (0, 1, 2, 7)] == [FINAL, WORK, FINAL, WORK]


def test_albedo_is_weighted_by_area_and_a_missing_wall_does_not_count() -> None:
    room = draw_room(3, "box", "mixed", "closed")
    plain = [replace(finish, albedo=(0.2, 0.2, 0.2), pattern=None) for finish in room.finishes]
    bright = replace(plain[0], albedo=(0.9, 0.9, 0.9))
    lit = replace(room, finishes=(bright, *plain[1:]))
    (x0, y0), (x1, y1) = room.plan.outline[0], room.plan.outline[2]
    width, depth, height = x1 - x0, y1 - y0, room.plan.height
    front, whole = width * height, 2.0 * (width * height + depth * height + width * depth)
    assert mean_albedo(lit) == pytest.approx(0.2 + 0.7 * front / whole)
    assert mean_albedo(replace(lit, open_wall=0)) == pytest.approx(0.2)
    assert room_properties(replace(lit, open_wall=0))["fronts"] == "open"


def test_cameras_along_one_wall_are_told_from_those_among_the_furniture() -> None:
    room = draw_room(3, "box")
    front = room.plan.outline[0][1]

    def camera(y: float, focal: float) -> Camera:
        return Camera(look_at(torch.tensor([0.0, y, 0.0]), torch.tensor([0.0, 9.0, 0.0])), focal, focal, 8, 8, 16, 16)

    one_side = camera_properties(room, [camera(front + 0.02, 8.0), camera(front - 0.3, 8.0 * math.sqrt(3.0))])
    assert one_side["stand"] == "one side" and one_side["lens"] == pytest.approx(75.0)  # of 90 and 60 degrees
    assert camera_properties(room, [camera(front, 8.0), camera(0.0, 8.0)])["stand"] == "among"


def test_the_share_that_no_camera_saw_is_by_area() -> None:
    surfels = room_surfels()
    assert share_unseen(surfels) == 0.0
    guessed = torch.zeros_like(surfels.opacities)
    guessed[:10] = 0.3
    areas = surfels.scales.prod(dim=1) * surfels.opacities
    found = share_unseen(replace(surfels, guessed=guessed))
    assert found == pytest.approx(float(areas[:10].sum() / areas.sum()), rel=1e-6)
    scales = surfels.scales.clone()
    scales[:10] *= 3.0
    assert share_unseen(replace(surfels, guessed=guessed, scales=scales)) > 5.0 * found
