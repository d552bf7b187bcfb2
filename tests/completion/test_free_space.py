"""Which cells of a scene's box its cameras look through."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from half_seen_room import TOP, camera_at, true_room
from rgspipe.completion.free_space import LONGEST_SIDE, MOST_CELLS, Grid, SeenSpace
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Camera, Surfels
from rgspipe.scene.rectangles import Rectangles, inside_of_box, rectangle, surfels_on

#: Around the room and the box that stands in it.
GRID = Grid.over(torch.zeros(3), torch.ones(3), 0.04)
MARGIN = 0.02

#: The box's corners.
BOX_LOWER, BOX_UPPER = torch.tensor([0.3, 0.3, 0.0]), torch.tensor([0.7, 0.7, TOP])


def free(surfels: Surfels, *cameras: Camera, grid: Grid = GRID) -> torch.Tensor:
    return SeenSpace.of(SurfelBvh(surfels), cameras).cells(grid, MARGIN)


def entry(origin: torch.Tensor, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Where lines from `origin` to `points` (N, 3) enter the box, of their length, and whether they do at all."""
    steps = (torch.stack([BOX_LOWER, BOX_UPPER])[:, None] - origin) / (points - origin)
    enters, leaves = steps.amin(dim=0).amax(dim=1), steps.amax(dim=0).amin(dim=1)
    return enters, (enters < leaves) & (enters > 0.0)


@pytest.fixture(scope="module")
def room() -> Surfels:
    return true_room()


@pytest.fixture(scope="module")
def camera() -> Camera:
    return camera_at([0.05, 0.12, 0.6], [0.6, 0.5, 0.3], 96)


def test_cells_fill_the_box_and_are_nearly_cubes() -> None:
    lower, upper = torch.tensor([-1.0, 2.0, 0.5]), torch.tensor([1.0, 3.0, 0.8])
    grid = Grid.over(lower, upper, 0.11)
    assert grid.shape == (18, 9, 3)
    torch.testing.assert_close(grid.lower + torch.tensor(grid.shape) * grid.cell, upper.double())
    assert float(grid.cell.max() / grid.cell.min()) < 1.15  # measured 1.11
    centers = grid.centers.reshape(*grid.shape, 3)
    torch.testing.assert_close(centers[0, 0, 0], lower.double() + 0.5 * grid.cell)
    torch.testing.assert_close(centers[2, 5, 1], lower.double() + torch.tensor([2.5, 5.5, 1.5]) * grid.cell)


def test_the_longest_side_has_no_more_than_the_most_cells() -> None:
    grid = Grid.over(torch.zeros(3), torch.tensor([10.0, 5.0, 0.01]), 1e-3)
    assert grid.shape == (MOST_CELLS, MOST_CELLS // 2, 2)


def test_a_flat_box_has_cells_that_are_not_empty() -> None:
    grid = Grid.over(torch.zeros(3), torch.tensor([1.0, 1.0, 0.0]), 0.1)
    assert grid.shape == (10, 10, 2)
    assert 0.0 < float(grid.cell[2]) < 1e-6 and bool(grid.centers.isfinite().all())


def test_cells_in_front_of_the_box_are_free_and_those_in_it_and_behind_it_are_not(
    room: Surfels, camera: Camera
) -> None:
    found = free(room, camera).reshape(-1)
    centers = GRID.centers
    pixel, depth = camera.project(centers)
    framed = (depth > 0.0) & ((pixel > 0.0) & (pixel < 96.0)).all(dim=1)
    enters, meets = entry(camera.origin, centers)
    inside = ((centers > BOX_LOWER) & (centers < BOX_UPPER)).all(dim=1)
    distance = (centers - camera.origin).norm(dim=1)
    hidden = meets & (enters < 1.0)
    gap = (1.0 - enters) * distance
    # A cell away from the margin, from walls and from the silhouette of the box, where a pixel sees both.
    away = (centers.sub(0.5).abs() < 0.5 - 0.06).all(dim=1) & ~(meets & (gap.abs() < 0.04))
    in_front, behind = framed & away & ~hidden, framed & hidden & ~inside & away
    assert int(inside.sum()) > 500 and int(behind.sum()) > 500 and int(in_front.sum()) > 2000
    assert not bool(found[inside].any())
    assert not bool(found[~framed].any())
    assert float(found[behind].double().mean()) < 0.02  # measured 0.9 %
    assert float(found[in_front].double().mean()) > 0.99  # measured 99.7 %


def test_each_camera_adds_what_it_looks_through(room: Surfels, camera: Camera) -> None:
    other = camera_at([0.95, 0.9, 0.6], [0.4, 0.5, 0.3], 96)
    both = free(room, camera, other)
    assert torch.equal(both, free(room, camera) | free(room, other))
    assert not bool(free(room).any())


def test_large_images_are_traced_coarsely_and_show_the_same_cells(
    room: Surfels, monkeypatch: pytest.MonkeyPatch
) -> None:
    large = camera_at([0.05, 0.12, 0.6], [0.6, 0.5, 0.3], 4 * LONGEST_SIDE)
    large = replace(large, height=3 * LONGEST_SIDE)
    traced, rays = [], Camera.rays

    def noted_rays(own: Camera) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        traced.append((own.width, own.height))
        return rays(own)

    monkeypatch.setattr(Camera, "rays", noted_rays)
    coarse = free(room, large)
    monkeypatch.setattr("rgspipe.completion.free_space.LONGEST_SIDE", 4 * LONGEST_SIDE)
    whole = free(room, large)
    assert traced == [(LONGEST_SIDE, 3 * LONGEST_SIDE // 4), (4 * LONGEST_SIDE, 3 * LONGEST_SIDE)]
    # Measured 1.9 %, and 0.3 % that only the coarse image takes to be free; 60 % are free.
    assert float((coarse != whole).double().mean()) < 0.03
    assert float((coarse & ~whole).double().mean()) < 0.006


def partition(normal: float) -> Rectangles:
    """A wall across the middle of a room that looks along x, or against it."""
    sides = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    return rectangle([0.5, 0.0, 0.0], *(sides if normal > 0 else sides[::-1]), [0.5, 0.5, 0.5])


def test_both_sides_of_a_surface_end_a_ray() -> None:
    room = inside_of_box([0.5, 0.5, 0.5], [1.0, 1.0, 1.0], [0.5, 0.5, 0.5])
    camera = camera_at([0.05, 0.5, 0.5], [1.0, 0.5, 0.5], 64)
    towards, away = (free(surfels_on(room + partition(side), 1000), camera) for side in (-1.0, 1.0))
    beyond = GRID.centers[:, 0].reshape(GRID.shape) > 0.5
    assert torch.equal(towards, away) and int(away.sum()) > 1000
    assert not bool(away[beyond].any())
    assert bool(free(surfels_on(room, 1000), camera)[beyond].any())


def test_rays_that_meet_nothing_look_through_all_of_the_box() -> None:
    wall = surfels_on(rectangle([2.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.5]), 100)
    away = camera_at([-2.0, 0.5, 0.5], [0.5, 0.5, 0.5], 64, 0.6)
    beside = replace(wall, centers=wall.centers + torch.tensor([0.0, 5.0, 0.0]))
    assert bool(free(beside, away)[:, 10:15, 10:15].all())


def test_a_pixel_beside_an_edge_sees_past_it_and_the_rays_around_a_point_do_not() -> None:
    """A wall at y = 0.5 ends at x = 0.5; the middle ray of nine pixels goes past it at x = 0.51."""
    wall = surfels_on(rectangle([-1.0, 0.5, -1.0], [1.5, 0.0, 0.0], [0.0, 0.0, 3.0], [0.5, 0.5, 0.5]), 1500)
    camera = camera_at([0.51, 0.0, 0.5], [0.51, 1.0, 0.5], 9, 1.2)
    space = SeenSpace.of(SurfelBvh(wall), [camera])
    # The way to the first goes through the wall; the second lies on the middle ray, and the last in the next pixel.
    points = torch.tensor([[0.46, 1.0, 0.5], [0.51, 1.0, 0.5], [0.75, 1.0, 0.5]])
    assert space.holds(points, 0.0).tolist() == [True, True, True]
    assert space.holds(points, 0.0, around=True).tolist() == [False, True, True]


def test_rays_end_at_surfels_or_at_the_photographs_depth_whichever_is_nearer() -> None:
    """A wall at y = 1; a photograph has depth in front of it, behind it and none."""
    wall = surfels_on(rectangle([-1.0, 1.0, -1.0], [3.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.5, 0.5, 0.5]), 3000)
    camera = camera_at([0.5, 0.0, 0.5], [0.5, 1.0, 0.5], 9, 1.2)
    places = torch.tensor([[0.5, y, 0.5] for y in (0.4, 0.6, 0.9, 1.1)])
    for depth, seen in ((0.5, 1), (1.5, 3), (torch.inf, 3), (torch.nan, 3)):
        space = SeenSpace.of(SurfelBvh(wall), [camera], [torch.full((9, 9), depth)])
        assert space.holds(places, 0.0).tolist() == [index < seen for index in range(4)]
