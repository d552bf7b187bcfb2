"""Lamps whose own pixels photographs show are not the radiance of the wall behind them; what shines itself is."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.capture.bulbs import without_bulbs
from rgspipe.datasets.views import View
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.view_weights import ViewWeights, build_view_weights
from rgspipe.scene import Camera, Surfels, look_at
from rgspipe.scene.rectangles import inside_of_box, surfels_on

#: Radiance of a wall, and of a bulb.
WALL, BULB = 0.5, 500.0


@pytest.fixture(scope="module")
def room() -> Surfels:
    return surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]), 2000).to(torch.float32)


def cameras() -> list[Camera]:
    """Two, 0.5 apart, that look at one wall."""
    return [
        Camera.from_field_of_view(look_at([side, -0.45, 0.0], [0.0, 0.5, 0.0]), 1.2, 48, 48) for side in (-0.25, 0.25)
    ]


def photographs(room: Surfels, bright: list[torch.Tensor]) -> tuple[list[ViewWeights], list[View]]:
    """Of walls that are all alike, and of something that shines where it is `bright` (48, 48)."""
    bvh, weights, views = SurfelBvh(room), [], []
    for camera, own in zip(cameras(), bright, strict=True):
        image = torch.where(own[..., None], BULB, WALL).expand(48, 48, 3).contiguous()
        views.append(View("train/0", camera, image, torch.ones(48, 48), None))
        weights.append(build_view_weights(bvh, camera, 1))
    return weights, views


def bulbs(place: list[float]) -> list[torch.Tensor]:
    """Nine pixels around a place."""
    found = []
    for camera in cameras():
        column, row = camera.project(torch.tensor(place, dtype=torch.float64))[0].long().tolist()
        found.append(torch.zeros(48, 48, dtype=torch.bool))
        found[-1][row - 1 : row + 2, column - 1 : column + 2] = True
    return found


def windows(half: float) -> list[torch.Tensor]:
    """A square in the wall."""
    found = []
    for camera in cameras():
        origins, directions, _ = camera.rays()
        places = origins + ((0.5 - origins[:, 1]) / directions[:, 1])[:, None] * directions
        found.append((places[:, [0, 2]].abs() < half).all(dim=1).reshape(48, 48))
    return found


def test_a_bulb_in_the_room_is_left_out_of_all_photographs(room: Surfels) -> None:
    """Behind it the two look at places 0.3 apart."""
    found = without_bulbs(*photographs(room, bulbs([0.0, 0.1, 0.0])), room)
    for view in found:
        kept = view.alpha > 0.0
        assert 9 < int((~kept).sum()) < 60  # measured 49: with two pixels around
        assert float(view.image[kept].max()) == WALL


@pytest.mark.parametrize("half", [0.04, 0.1])
def test_a_window_in_the_wall_stays(room: Surfels, half: float) -> None:
    weights, views = photographs(room, windows(half))
    for view, found in zip(views, without_bulbs(weights, views, room), strict=True):
        assert found is view


def test_a_bulb_before_a_window_goes_alone(room: Surfels) -> None:
    """It is a hundred times brighter, and a hand's breadth before it."""
    weights, views = photographs(room, windows(0.1))
    lit = []
    for view, bulb in zip(views, bulbs([0.0, 0.35, 0.0]), strict=True):
        lit.append(replace(view, image=torch.where(bulb[..., None], 100.0 * BULB, view.image)))
    for before, found in zip(lit, without_bulbs(weights, lit, room), strict=True):
        kept = found.alpha > 0.0
        assert float(before.image[kept].max()) == BULB
        assert 9 < int((~kept).sum()) < 60  # measured 49


def test_of_a_single_photograph_nothing_is_left_out(room: Surfels) -> None:
    weights, views = photographs(room, bulbs([0.0, 0.1, 0.0]))
    assert without_bulbs(weights[:1], views[:1], room) == views[:1]


def test_where_nothing_shines_photographs_stay_as_they_are(room: Surfels) -> None:
    weights, views = photographs(room, [torch.zeros(48, 48, dtype=torch.bool)] * 2)
    assert all(one is other for one, other in zip(without_bulbs(weights, views, room), views, strict=True))
