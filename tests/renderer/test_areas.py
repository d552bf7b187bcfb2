"""The surface that each surfel stands for."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.rectangles import inside_of_box, rectangle, surfels_on
from rgspipe.scene.surfels import NO_CLIP, Surfels
from rooms import closed_box


def test_areas_add_up_to_the_surface() -> None:
    room = surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]), 1536).to(torch.float32)
    areas = surfel_areas(SurfelBvh(room), seed=0)
    # Measured +0.4 %: footprints reach past the box's edges by a twentieth of the spacing.
    assert float(areas.sum()) == pytest.approx(6.0, rel=0.01)
    # Even cells of 1/256; measured mean −0.03 % and spread 1.1 %, the noise of 32 points each.
    inner = (room.centers.abs() < 0.4).sum(dim=1) == 2
    assert float(areas[inner].mean()) == pytest.approx(1 / 256, rel=0.005)
    assert float(areas[inner].std()) < 0.025 / 256


def test_areas_are_seeded() -> None:
    bvh = SurfelBvh(closed_box(1 / 8).to(torch.float32))
    assert torch.equal(surfel_areas(bvh, seed=1), surfel_areas(bvh, seed=1))


def test_what_lies_behind_an_edge_is_not_counted_twice() -> None:
    grey = [0.5, 0.5, 0.5]
    floor, table = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0], grey), rectangle([0, 0, 1], [1, 0, 0], [0, 1, 0], grey)
    alone, both = whole(surfels_on(floor, 400)), whole(surfels_on(floor + table, 500))
    below = both.centers[:, 2] == 0.0
    areas = surfel_areas(SurfelBvh(both), seed=0)[below]
    # Points past the table's edges went on to the floor, which came out 2 % larger.
    assert float(areas.sum()) == pytest.approx(float(surfel_areas(SurfelBvh(alone), seed=0).sum()), rel=0.002)  # equal


def whole(surfels: Surfels) -> Surfels:
    """Without edges, so that their faint ends reach past those of the surface."""
    return replace(surfels, clip_offsets=torch.full_like(surfels.clip_offsets, NO_CLIP)).to(torch.float32)
