"""Rectangles and the surfels on them: exact places, normals, areas and edges."""

from __future__ import annotations

import pytest
import torch

from rgspipe.benchmark.rooms import ROOMS
from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.rectangles import inside_of_box, rectangle, solid_box, surfels_on


def test_a_box_faces_outwards_and_a_room_inwards() -> None:
    center = torch.tensor([0.3, -0.2, 0.1], dtype=torch.float64)
    for shape, sign in (
        (solid_box(center.tolist(), [1, 2, 3], [0.5] * 3, turn=0.4), 1),
        (inside_of_box(center.tolist(), [1, 2, 3], [0.5] * 3), -1),
    ):
        normals = torch.linalg.cross(shape.sides_a, shape.sides_b)
        outward = shape.corners.mean(dim=1) - center
        assert bool((sign * (normals * outward).sum(dim=1) > 0).all())
        torch.testing.assert_close(shape.areas.sort().values, torch.tensor([2, 2, 3, 3, 6, 6], dtype=torch.float64))


@pytest.mark.parametrize("count", [500, 3000])
def test_surfels_lie_on_their_rectangle_and_face_its_front(count: int) -> None:
    sheet = rectangle([0, 0, 1], [2, 0, 0], [0, 1, 0], [0.2, 0.4, 0.6])
    surfels = surfels_on(sheet, count)
    assert 0.9 * count < len(surfels) < 1.1 * count
    assert float((surfels.centers[:, 2] - 1).abs().max()) < 1e-12
    torch.testing.assert_close(
        surfels.normals, torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64).expand(len(surfels), 3)
    )
    # Measured -0.04 %: what the random points of the areas leave.
    assert float(surfel_areas(SurfelBvh(surfels.to(torch.float32))).sum()) == pytest.approx(2.0, rel=0.01)


def test_a_surface_is_opaque_to_its_edge_and_gone_behind_it() -> None:
    surfels = surfels_on(rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5] * 3), 400)
    bvh, margin = SurfelBvh(surfels.to(torch.float32)), 0.04 * 0.05
    along = torch.linspace(0.001, 0.999, 333, dtype=torch.float64)
    for offset, expected in ((margin, 0.0), (-margin, 1.0)):
        origins = torch.stack([torch.full_like(along, offset), along, torch.ones_like(along)], dim=1)
        passing = composite(bvh, origins, torch.tensor([[0.0, 0.0, -1.0]]).double().expand(333, 3)).transmittance
        # Measured 0: the ramp at an edge is 0.05 of the spacing wide.
        assert float((passing - expected).abs().max()) < 0.01


@pytest.mark.parametrize("name", ROOMS)
def test_rooms_have_lights_in_the_open_and_near_surfaces(name: str) -> None:
    room = ROOMS[name]()
    clearances = [room.clearance(light) for light in range(len(room.lights))]
    assert min(clearances[:3]) >= 0.1
    assert max(clearances[3:]) < 0.1
    for camera in room.cameras(8):
        covered = (
            1.0
            - composite(SurfelBvh(surfels_on(room.surfaces, 2000).to(torch.float32)), *camera.rays()[:2]).transmittance
        )
        assert float(covered.mean()) > 0.7
