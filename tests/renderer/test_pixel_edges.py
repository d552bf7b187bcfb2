"""Which pixels an edge crosses: told apart from those that it only passes by."""

from __future__ import annotations

import pytest
import torch

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_edges import Seen, pixels_beside_edges, pixels_on_edges
from rgspipe.scene import Camera, look_at
from rgspipe.scene.rectangles import rectangle, surfels_on

SIZE = 16
WHITE = [0.5, 0.5, 0.5]


def surfels_up_to(line: float) -> SurfelBvh:
    """A plate in the plane y = 1 in front of a wall in y = 2, that ends at pixel column `line` of `camera`."""
    x = line / SIZE - 0.5
    plate = rectangle([-2.0, 1.0, -2.0], [x + 2.0, 0.0, 0.0], [0.0, 0.0, 4.0], WHITE)
    wall = rectangle([-4.0, 2.0, -4.0], [8.0, 0.0, 0.0], [0.0, 0.0, 8.0], WHITE)
    return SurfelBvh(surfels_on(plate + wall, 6000).to(torch.float32))


def camera() -> Camera:
    """At the origin, along +y, one unit wide at y = 1."""
    pose = look_at(torch.zeros(3), torch.tensor([0.0, 1.0, 0.0]))
    return Camera(pose, float(SIZE), float(SIZE), 0.5 * SIZE, 0.5 * SIZE, SIZE, SIZE)


def columns_found(bvh: SurfelBvh) -> tuple[list[int], list[int]]:
    """Columns of the pixels beside the edge, and of those on it."""
    view = camera()
    origins, directions, lengths = view.rays()
    seen = Seen.of(bvh, composite(bvh, origins, directions), lengths).reshape(SIZE, SIZE)
    beside = pixels_beside_edges(seen)
    crossed = pixels_on_edges(bvh, view, seen, beside, nearest=1e-4)
    assert sorted(crossed.tolist()) == crossed.tolist()
    return sorted(set(beside.nonzero()[:, 1].tolist())), sorted({p % SIZE for p in crossed.tolist()})


@pytest.mark.parametrize("line", [5.2, 5.4, 5.6, 5.8, 9.3, 9.7])
def test_both_pixels_beside_a_line_are_found_and_the_one_that_it_crosses_is_chosen(line: float) -> None:
    beside, crossed = columns_found(surfels_up_to(line))
    nearest = round(line)
    assert beside == [nearest - 1, nearest]
    assert crossed == [int(line)]


def test_every_row_of_a_vertical_line_is_chosen() -> None:
    bvh = surfels_up_to(7.4)
    view = camera()
    origins, directions, lengths = view.rays()
    seen = Seen.of(bvh, composite(bvh, origins, directions), lengths).reshape(SIZE, SIZE)
    crossed = pixels_on_edges(bvh, view, seen, pixels_beside_edges(seen), nearest=1e-4)
    assert crossed.tolist() == [row * SIZE + 7 for row in range(SIZE)]


def test_a_plain_wall_has_no_edge() -> None:
    wall = rectangle([-4.0, 2.0, -4.0], [8.0, 0.0, 0.0], [0.0, 0.0, 8.0], WHITE)
    bvh = SurfelBvh(surfels_on(wall, 3000).to(torch.float32))
    assert columns_found(bvh) == ([], [])


def test_an_edge_against_the_void_counts_by_its_coverage() -> None:
    plate = rectangle([-2.0, 1.0, -2.0], [2.0 + 6.3 / SIZE - 0.5, 0.0, 0.0], [0.0, 0.0, 4.0], WHITE)
    bvh = SurfelBvh(surfels_on(plate, 3000).to(torch.float32))
    beside, crossed = columns_found(bvh)
    assert beside == [5, 6]
    assert crossed == [6]
