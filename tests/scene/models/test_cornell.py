"""The exact Cornell box: walls face into the room, boxes face out of themselves."""

import math

import pytest
import torch

from rgspipe.scene.models import Box, CornellBox, exact_surfels

WHITE, LEFT, RIGHT = (0.7, 0.7, 0.7), (0.6, 0.1, 0.1), (0.1, 0.5, 0.1)
BOX = Box((0.1, -0.2, -0.25), (0.2, 0.3, 0.5), 0.3, (0.2, 0.3, 0.4))


def _box(room: tuple[float, float, float], *boxes: Box, gloss: float = 0.0) -> CornellBox:
    return CornellBox(room, WHITE, LEFT, RIGHT, boxes, gloss)


def _normals(surfaces) -> torch.Tensor:
    return torch.linalg.cross(surfaces.sides_a, surfaces.sides_b) / surfaces.areas[:, None]


def test_walls_face_the_middle_of_the_room_and_lie_on_its_sides() -> None:
    room = (1.0, 0.8, 0.6)
    walls = _box(room).rectangles()
    assert len(walls) == 5
    centers = walls.corners.mean(dim=1)
    assert bool(((_normals(walls) * -centers).sum(dim=1) > 0.0).all())
    assert walls.corners.amax(dim=(0, 1)).tolist() == pytest.approx([0.5 * side for side in room])
    assert float(walls.areas.sum()) == pytest.approx(2 * 1.0 * 0.8 + 1.0 * 0.6 + 2 * 0.8 * 0.6)
    assert not bool((centers[:, 1] < -0.1).any()), "it is open towards −y"


def test_the_sides_have_their_colours() -> None:
    walls = _box((1.0, 1.0, 1.0)).rectangles()
    for sign, colour in ((-1.0, LEFT), (1.0, RIGHT)):
        side = (walls.corners.mean(dim=1)[:, 0] - sign * 0.5).abs() < 1e-12
        assert walls.albedo[side].tolist() == [pytest.approx(list(colour))]


def test_a_box_is_closed_turned_and_faces_outwards() -> None:
    box = _box((1.0, 1.0, 1.0), BOX).rectangles()
    faces = slice(5, 11)
    outwards = box.corners[faces].mean(dim=1) - torch.tensor(BOX.center, dtype=torch.float64)
    assert bool(((_normals(box)[faces] * outwards).sum(dim=1) > 0.0).all())
    assert float(box.areas[faces].sum()) == pytest.approx(2 * (0.2 * 0.3 + 0.2 * 0.5 + 0.3 * 0.5))
    # Turned counter-clockwise seen from above: the side along +x points to (cos, sin).
    assert float(_normals(box)[faces][:, 0].amax()) == pytest.approx(math.cos(0.3), abs=1e-12)
    assert box.albedo[faces].unique(dim=0).tolist() == [pytest.approx(list(BOX.albedo))]


def test_exact_surfels_are_glossy_on_the_boxes_alone() -> None:
    surfels = exact_surfels(_box((1.0, 1.0, 1.0), BOX, gloss=0.3), 500)
    assert surfels.centers.dtype == torch.float32 and len(surfels) == pytest.approx(500, rel=0.1)
    on_box = (surfels.albedo - torch.tensor(BOX.albedo)).abs().amax(dim=1) < 1e-6
    assert surfels.gloss is not None and surfels.gloss.glossy.tolist() == on_box.nonzero()[:, 0].tolist()
    assert surfels.gloss.reflectance[on_box].unique().tolist() == [pytest.approx(0.3)]
    assert surfels.gloss.exponents[on_box].unique().tolist() == [20.0]
    assert exact_surfels(_box((1.0, 1.0, 1.0), BOX), 500).gloss is None
