"""Training closes a room where no view saw what is there."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from half_seen_room import BACK, cameras_in_front, true_room, without_back
from painted_room import LIGHT, photographed
from rgspipe.datasets.views import View
from rgspipe.scene import PointLight, Surfels
from rgspipe.training.trainer import train


@pytest.fixture(scope="module")
def room() -> Surfels:
    return true_room(900).to(torch.float32)


@pytest.fixture(scope="module")
def views(room: Surfels) -> list[View]:
    """Of the whole room, with lamps beside the back of the box, which none of the cameras sees."""
    lamps = [PointLight(torch.tensor([BACK + 0.12, 0.5, z]).double(), torch.ones(3).double()) for z in (0.15, 0.3)]
    cameras = cameras_in_front(48)
    return photographed(room, cameras, [lamps[index % 2] for index in range(len(cameras))])


@pytest.mark.parametrize("steps", [0, 1])
def test_a_room_is_closed_before_the_last_fit_of_materials_and_its_albedo_comes_out_better(
    room: Surfels, views: list[View], steps: int
) -> None:
    seen = without_back(room)
    start = replace(seen, albedo=torch.full_like(seen.albedo, 0.5))
    options = replace(LIGHT, rounds=4, steps=steps, views_per_step=4, interior_pixels=100, subsamples=1)
    closed, left = (train(views, start, replace(options, unseen=unseen)).surfels for unseen in (True, False))
    added = closed.centers[len(seen) :]
    assert len(left) == len(seen) and 5 <= len(added) <= 25  # measured 15 and 15; 25 are missing
    off = (added[:, 0] - BACK).abs()
    # Measured 0.0017 and 0.0016; surfels are 0.08 apart.
    assert float(off.max()) < 0.01
    # Measured 0.041 and 0.049 without steps, 0.034 and 0.049 with one, to 0.0002 on any processor.
    errors = [float((found.albedo[: len(seen)] - seen.albedo).abs().mean()) for found in (closed, left)]
    assert errors[0] < 0.9 * errors[1]
