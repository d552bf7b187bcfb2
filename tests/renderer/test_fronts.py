"""Fronts from cameras: what a wall hides from a camera does not look at it."""

from __future__ import annotations

import pytest
import torch

from clouds import moved
from rgspipe.renderer.fronts import backs_towards_cameras, spread_out
from rgspipe.scene import Surfels
from rgspipe.scene.orientation import backs_towards, turned_over
from rooms import closed_box

#: A wall of 0.2: one thinner than 2.5 scales (0.15) casts no shadow on its own other side.
NEXT_DOOR = 1.2


def two_rooms() -> tuple[Surfels, torch.Tensor]:
    """Two closed rooms side by side, a wall between them, and which of the surfels are the second's."""
    one = closed_box(0.1)
    two = moved(one, torch.tensor([NEXT_DOOR, 0.0, 0.0], dtype=torch.float64))
    both = Surfels(
        **{name: torch.cat([part, getattr(two, name)]) for name, part in one.tensors().items()}, coverage=one.coverage
    )
    return both, torch.arange(len(both)) >= len(one)


def test_cameras_behind_a_wall_do_not_turn_it_over() -> None:
    rooms, second = two_rooms()
    cameras = torch.zeros(31, 3, dtype=torch.float64)
    cameras[:30, 0] = 0.4 - 0.01 * torch.arange(30)
    cameras[30, 0] = NEXT_DOOR
    through_walls = backs_towards(rooms, cameras)
    assert int(through_walls.sum()) == 100 and not through_walls[~second].any(), "the wall between, its side next door"
    assert not backs_towards_cameras(rooms, cameras).any()


@pytest.mark.parametrize("seed", [0, 1])
def test_fronts_do_not_depend_on_those_of_the_file(seed: int) -> None:
    rooms, _ = two_rooms()
    cameras = torch.tensor([[0.1, 0.2, 0.0], [NEXT_DOOR, -0.1, 0.1]], dtype=torch.float64)
    flipped = torch.rand(len(rooms), generator=torch.Generator().manual_seed(seed)) < 0.5
    assert torch.equal(backs_towards_cameras(turned_over(rooms, flipped), cameras), flipped)


def test_a_surfel_that_no_camera_sees_gets_a_side() -> None:
    rooms, second = two_rooms()
    away = backs_towards_cameras(rooms, torch.zeros(1, 3, dtype=torch.float64))
    assert not away[~second].any()
    assert torch.equal(away[second], backs_towards(rooms, torch.zeros(1, 3))[second])


def test_the_cameras_that_are_taken_lie_far_from_each_other() -> None:
    line = torch.tensor([0.0, 0.1, 0.2, 1.0, 0.5])[:, None] * torch.tensor([1.0, 2.0, 0.0])
    assert torch.equal(spread_out(line, 3), line[[0, 3, 4]])
    assert torch.equal(spread_out(line, 9)[[0, 1, 2]], line[[0, 3, 4]]) and len(spread_out(line, 9)) == 5
