"""Flat surfaces among surfels, and which way a room is turned."""

from __future__ import annotations

import pytest
import torch
from scipy.spatial.transform import Rotation

from half_seen_room import true_room
from rgspipe.completion.planes import FEWEST, frame_of, planes_of
from rgspipe.scene import Surfels
from rgspipe.scene.rectangles import rectangle, surfels_on

SPACING = 1.0 / 15.0


@pytest.fixture(scope="module")
def room() -> Surfels:
    return true_room()


def test_a_room_with_a_box_has_the_planes_of_its_faces(room: Surfels) -> None:
    planes = planes_of(room, SPACING)
    assert len(planes) == 6 + 5
    members = torch.cat([plane.members for plane in planes])
    assert len(members.unique()) == len(members) == len(room)
    for plane in planes:
        assert float(plane.normal.abs().max()) == pytest.approx(1.0, abs=1e-9)
        off = room.centers[plane.members].double() @ plane.normal - plane.offset
        assert float(off.abs().max()) < 1e-9
        assert bool((room.normals[plane.members].double() @ plane.normal > 0.99).all())


def test_few_surfels_are_no_plane() -> None:
    few = surfels_on(rectangle([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5] * 3), 9)
    assert len(few) < FEWEST and planes_of(few, 1.0 / 3.0) == []


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.2, -0.1, 0.3), (-0.4, 0.3, 0.5)])
def test_the_frame_is_that_of_the_walls_and_a_rotation(room: Surfels, angles: tuple[float, float, float]) -> None:
    turn = torch.from_numpy(Rotation.from_euler("xyz", angles).as_matrix())
    planes = [plane.turned(turn) for plane in planes_of(room, SPACING)]
    frame = frame_of(planes)
    torch.testing.assert_close(frame @ turn, torch.eye(3, dtype=torch.float64), rtol=0.0, atol=1e-12)
    assert float(torch.linalg.det(frame)) == pytest.approx(1.0)


def test_without_two_planes_across_each_other_the_axes_stay(room: Surfels) -> None:
    assert torch.equal(frame_of([]), torch.eye(3, dtype=torch.float64))
    assert torch.equal(frame_of(planes_of(room, SPACING)[:1]), torch.eye(3, dtype=torch.float64))
