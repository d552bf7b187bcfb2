"""The exact Cornell box: walls face into the room, boxes face out of themselves."""

import math

import pytest
import torch

from rgspipe.scene.cornell import cornell_rectangles

WHITE, LEFT, RIGHT = (0.7, 0.7, 0.7), (0.6, 0.1, 0.1), (0.1, 0.5, 0.1)
BOX = ((0.1, -0.2, -0.25), (0.2, 0.3, 0.5), 0.3, (0.2, 0.3, 0.4))


def _normals(surfaces) -> torch.Tensor:
    return torch.linalg.cross(surfaces.sides_a, surfaces.sides_b) / surfaces.areas[:, None]


def test_walls_face_the_middle_of_the_room_and_lie_on_its_sides() -> None:
    room = (1.0, 0.8, 0.6)
    walls = cornell_rectangles(room, WHITE, LEFT, RIGHT, [])
    assert len(walls) == 5
    centers = walls.corners.mean(dim=1)
    assert bool(((_normals(walls) * -centers).sum(dim=1) > 0.0).all())
    assert walls.corners.amax(dim=(0, 1)).tolist() == pytest.approx([0.5 * side for side in room])
    assert float(walls.areas.sum()) == pytest.approx(2 * 1.0 * 0.8 + 1.0 * 0.6 + 2 * 0.8 * 0.6)
    assert not bool((centers[:, 1] < -0.1).any()), "it is open towards −y"


def test_the_sides_have_their_colours() -> None:
    walls = cornell_rectangles((1.0, 1.0, 1.0), WHITE, LEFT, RIGHT, [])
    for sign, colour in ((-1.0, LEFT), (1.0, RIGHT)):
        side = (walls.corners.mean(dim=1)[:, 0] - sign * 0.5).abs() < 1e-12
        assert walls.albedo[side].tolist() == [pytest.approx(list(colour))]


def test_a_box_is_closed_turned_and_faces_outwards() -> None:
    box = cornell_rectangles((1.0, 1.0, 1.0), WHITE, LEFT, RIGHT, [BOX])
    faces = slice(5, 11)
    outwards = box.corners[faces].mean(dim=1) - torch.tensor(BOX[0], dtype=torch.float64)
    assert bool(((_normals(box)[faces] * outwards).sum(dim=1) > 0.0).all())
    assert float(box.areas[faces].sum()) == pytest.approx(2 * (0.2 * 0.3 + 0.2 * 0.5 + 0.3 * 0.5))
    # Turned counter-clockwise seen from above: the side along +x points to (cos, sin).
    assert float(_normals(box)[faces][:, 0].amax()) == pytest.approx(math.cos(0.3), abs=1e-12)
    assert box.albedo[faces].unique(dim=0).tolist() == [pytest.approx(list(BOX[3]))]
