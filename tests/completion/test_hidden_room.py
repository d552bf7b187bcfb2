"""Which room is there although no camera looked into it."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from half_seen_room import BACK, SIDES, TOP, only, true_room, without_back
from rgspipe.completion.free_space import Grid
from rgspipe.completion.hidden_room import parts_in_sight, sees_fronts, with_hidden_room
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Surfels
from rgspipe.scene.rectangles import rectangle, solid_box, surfels_on

GRID = Grid.over(torch.zeros(3), torch.ones(3), 0.05)


def bvh_of(surfels: Surfels) -> SurfelBvh:
    return SurfelBvh(replace(surfels, centers=surfels.centers.double()))


@pytest.fixture(scope="module")
def room() -> SurfelBvh:
    return bvh_of(true_room())


def inside_the_box(points: torch.Tensor, margin: float) -> torch.Tensor:
    """(P,) bool: points farther than `margin` inside, less far outside if it is negative."""
    lower, upper = torch.tensor([0.3, SIDES[0], -1.0]), torch.tensor([BACK, SIDES[1], TOP])
    return ((points > lower + margin) & (points < upper - margin)).all(dim=1)


@settings(deadline=None, max_examples=40)
@given(st.tuples(*3 * [st.floats(0.1, 0.9)]))
def test_in_a_room_all_that_is_met_are_fronts_and_inside_a_thing_none(
    room: SurfelBvh, place: tuple[float, float, float]
) -> None:
    point = torch.tensor([place], dtype=torch.float64)
    part = float(parts_in_sight(room, point)[0])
    if not bool(inside_the_box(point, -0.05)):
        assert part > 0.85  # measured 0.93 and more: some light passes between surfels this far apart
    elif bool(inside_the_box(point, 0.05)):
        assert part < 0.3  # measured 0.19: the box stands on no surfels, and the floor's reach below it


def test_looks_that_could_change_nothing_are_left_out(room: SurfelBvh) -> None:
    points = torch.rand(2000, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    fronts = parts_in_sight(room, points)[0] > 0.5
    assert 0.05 < float((~fronts).double().mean()) < 0.95  # 0.065
    assert torch.equal(torch.from_numpy(sees_fronts(room, points)), fronts)
    assert sees_fronts(room, points[:0]).shape == (0,)


def test_in_the_plane_of_a_hole_it_is_a_half() -> None:
    """A cube without one of its faces, before a wall that is so wide that one sees little but it outside the cube."""
    cube = surfels_on(solid_box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5] * 3), 6000)
    wall = surfels_on(rectangle([3.0, -40.0, -40.0], [0.0, 0.0, 80.0], [0.0, 80.0, 0.0], [0.5] * 3), 20000)
    cube = only(cube, cube.normals[:, 0] < 0.9)
    both = replace(cube, **{name: torch.cat([t, wall.tensors()[name]]) for name, t in cube.tensors().items()})
    distances = torch.tensor([0.0, 0.05, 0.2, 0.5], dtype=torch.float64)
    points = torch.stack([0.5 - distances, torch.zeros(4), torch.zeros(4)], dim=1)
    # Through the hole, a square of side 1, one sees 4 asin(a² / (a² + d²)) of 4 π steradians; a is half the side.
    part = torch.asin(0.25 / (0.25 + distances**2)) / torch.pi
    torch.testing.assert_close(parts_in_sight(bvh_of(both), points)[0].double(), part, rtol=0.0, atol=0.04)  # 0.031


def test_hidden_room_is_free_and_the_inside_of_things_is_not(room: SurfelBvh) -> None:
    seen, unsure = torch.zeros(GRID.shape, dtype=torch.bool), torch.zeros(GRID.shape, dtype=torch.bool)
    seen[2, 2, 10] = True
    free = with_hidden_room(GRID, room, seen, unsure).reshape(-1)
    inside = inside_the_box(GRID.centers, 0.0)
    assert bool(free[~inside].all()) and not bool(free[inside].any())


def test_room_that_nothing_connects_with_what_was_seen_stays_unknown(room: SurfelBvh) -> None:
    seen, unsure = torch.zeros(GRID.shape, dtype=torch.bool), torch.zeros(GRID.shape, dtype=torch.bool)
    assert not bool(with_hidden_room(GRID, room, seen, unsure).any())
    seen[2, 2, 10], unsure[:, 10] = True, True
    free = with_hidden_room(GRID, room, seen, unsure)
    assert bool(free[:, :10].any()) and not bool(free[:, 10:].any())


def test_where_a_face_is_missing_the_room_ends_near_it() -> None:
    seen, unsure = torch.zeros(GRID.shape, dtype=torch.bool), torch.zeros(GRID.shape, dtype=torch.bool)
    seen[2, 2, 10] = True
    free = with_hidden_room(GRID, bvh_of(without_back(true_room())), seen, unsure).reshape(-1)
    inside = inside_the_box(GRID.centers, 0.0)
    far = inside & (GRID.centers[:, 0] < BACK - 0.1)
    assert bool(free[~inside].all()) and not bool(free[far].any())
    assert float(free[inside].double().mean()) < 0.1  # measured 6.4 %, a cell or two behind the missing face
