"""View weights: which pixels are edges, how exactly they are resolved, and what an image is."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rays import normalised_weights
from rgspipe.renderer.view_weights import build_view_weights, even_places, nearest_hit
from rgspipe.scene import Camera, look_at
from rgspipe.scene.rectangles import inside_of_box, solid_box, surfels_on

RESOLUTION = 48


@pytest.fixture(scope="module")
def bvh() -> SurfelBvh:
    """A room with a box that stands askew in it."""
    room = inside_of_box([0, 0, 0], [1, 1, 1], [0.7, 0.7, 0.7]) + solid_box(
        [0, 0, -0.3], [0.4, 0.4, 0.4], [0.2] * 3, 0.4
    )
    return SurfelBvh(surfels_on(room, 3000).to(torch.float32))


@pytest.fixture(scope="module")
def camera() -> Camera:
    return Camera.from_field_of_view(
        look_at(torch.tensor([0.4, -0.42, 0.3]), torch.zeros(3)), 1.1, RESOLUTION, RESOLUTION
    )


def radiance(bvh: SurfelBvh) -> Tensor:
    """(N, 3) that differs from wall to wall and from wall to box."""
    return (bvh.surfels.normals + 1.5) * bvh.surfels.albedo


def exact_image(bvh: SurfelBvh, camera: Camera, side: int = 12) -> Tensor:
    """(pixels, 3) every pixel the mean of side² rays."""
    values = []
    for pixels in torch.arange(camera.pixel_count).split(500):
        origins, directions, _ = camera.rays(pixels, side)
        hits = composite(bvh, origins.float(), directions.float(), nearest=nearest_hit(bvh))
        seen = radiance(bvh)[hits.indices.clamp(min=0).long()]
        # Columns past the hits have weight 0.
        values.append((normalised_weights(hits)[..., None] * seen).sum(dim=1).reshape(-1, side**2, 3).mean(dim=1))
    return torch.cat(values)


def test_edges_are_resolved_by_supersampling(bvh: SurfelBvh, camera: Camera) -> None:
    exact = exact_image(bvh, camera)
    errors = {}
    for supersampling in (1, 2, 4):
        view = build_view_weights(bvh, camera, supersampling)
        error = (view.image(radiance(bvh)).reshape(-1, 3) - exact).square().mean(dim=1)
        errors[supersampling] = float(error.mean().sqrt())
        away = float(error[~view.edges].mean().sqrt())
        # Measured 1.3e-7: the walls are uniform.
        assert away < 2e-6
    # Measured 0.051, 0.021 and 0.0063, for radiances from 0.1 to 1.75.
    assert errors[2] < 0.5 * errors[1]
    assert errors[4] < 0.5 * errors[2]
    assert errors[4] < 8e-3


@pytest.mark.parametrize("count", [4, 9, 16, 64])
def test_places_fill_every_row_and_column_of_a_pixel_once(count: int) -> None:
    cells = (even_places(count) * count).floor()
    for column in cells.T:
        assert sorted(column.tolist()) == list(range(count))


def test_an_edge_along_an_axis_is_resolved_to_one_ray(bvh: SurfelBvh) -> None:
    """The share of a pixel left of a vertical line is exact to 1/(2·16); a grid of 4 × 4 is off by up to 1/8."""
    places = even_places(16)
    lines = torch.linspace(0, 1, 200, dtype=torch.float64)
    found = (places[:, 0] < lines[:, None]).double().mean(dim=1)
    assert float((found - lines).abs().max()) <= 1 / 32 + 1e-12


def test_rows_sum_to_the_coverage(bvh: SurfelBvh, camera: Camera) -> None:
    view = build_view_weights(bvh, camera)
    assert view.operator.shape == (RESOLUTION**2, len(bvh.surfels))
    sums = (view.operator @ torch.ones(len(bvh.surfels), 1))[:, 0]
    torch.testing.assert_close(view.coverage, sums, atol=1e-5, rtol=0)
    # A closed room: measured minimum 1.0000.
    assert float(view.coverage.min()) > 0.999


def test_plain_walls_are_no_edges(bvh: SurfelBvh) -> None:
    pose = look_at(torch.tensor([0.2, 0.0, 0.2]), torch.tensor([0.5, 0.0, 0.2]))
    camera = Camera.from_field_of_view(pose, 0.9, 16, 16)
    assert not bool(build_view_weights(bvh, camera).edges.any())


def test_blocks_of_rays_do_not_change_the_result(
    bvh: SurfelBvh, camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = build_view_weights(bvh, camera)
    monkeypatch.setattr("rgspipe.renderer.view_weights.RAYS_AT_ONCE", 100)
    parts = build_view_weights(bvh, camera)
    assert torch.equal(whole.edges, parts.edges)
    assert (whole.operator.to_scipy() != parts.operator.to_scipy()).nnz == 0
