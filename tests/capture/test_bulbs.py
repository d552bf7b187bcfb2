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


def photographs(room: Surfels, place: list[float]) -> tuple[list[ViewWeights], list[View]]:
    """Two, from places 0.5 apart, of walls that are all alike and of something bright around `place`."""
    bvh, weights, views = SurfelBvh(room), [], []
    for side in (-0.25, 0.25):
        camera = Camera.from_field_of_view(look_at([side, -0.45, 0.0], [0.0, 0.5, 0.0]), 1.2, 48, 48)
        image = torch.full((48, 48, 3), WALL)
        column, row = camera.project(torch.tensor(place, dtype=torch.float64))[0].long().tolist()
        image[row - 1 : row + 2, column - 1 : column + 2] = BULB
        views.append(View(f"train/{side}", camera, image, torch.ones(48, 48), None))
        weights.append(build_view_weights(bvh, camera, 1))
    return weights, views


def test_a_bulb_in_the_room_is_left_out_of_all_photographs(room: Surfels) -> None:
    """Behind it the two look at places 0.3 apart."""
    found = without_bulbs(*photographs(room, [0.0, 0.1, 0.0]), room)
    for view in found:
        kept = view.alpha > 0.0
        assert 9 < int((~kept).sum()) < 60  # measured 49: with two pixels around
        assert float(view.image[kept].max()) == WALL


def test_what_shines_on_the_wall_stays(room: Surfels) -> None:
    weights, views = photographs(room, [0.0, 0.5, 0.0])
    for view, found in zip(views, without_bulbs(weights, views, room), strict=True):
        assert found is view


def test_of_a_single_photograph_nothing_is_left_out(room: Surfels) -> None:
    weights, views = photographs(room, [0.0, 0.1, 0.0])
    assert without_bulbs(weights[:1], views[:1], room) == views[:1]


def test_where_nothing_shines_photographs_stay_as_they_are(room: Surfels) -> None:
    weights, views = photographs(room, [0.0, 0.1, 0.0])
    plain = [replace(view, image=torch.full_like(view.image, WALL)) for view in views]
    assert all(one is other for one, other in zip(without_bulbs(weights, plain, room), plain, strict=True))
