"""Where rays meet surfaces."""

from __future__ import annotations

import pytest
import torch

from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.looked_at import surface_ahead
from rooms import closed_box


@pytest.mark.parametrize("aim", [(0.0, 0.0, 1.0), (0.3, -0.2, 0.9)])
def test_a_ray_meets_the_ceiling_of_a_room(aim: tuple[float, ...]) -> None:
    bvh = SurfelBvh(closed_box(1 / 8).to(torch.float32))
    origin = torch.tensor([0.05, -0.1, 0.15], dtype=torch.float64)
    way = torch.nn.functional.normalize(torch.tensor(aim, dtype=torch.float64), dim=0)
    place, normal = surface_ahead(bvh, origin, way)
    torch.testing.assert_close(place, origin + 0.35 / way[2] * way, rtol=0.0, atol=1e-6)  # measured 1e-8
    torch.testing.assert_close(normal, torch.tensor([0.0, 0.0, -1.0]).double(), rtol=0.0, atol=1e-6)


def test_a_ray_out_of_the_scene_meets_nothing() -> None:
    bvh = SurfelBvh(closed_box(1 / 8).to(torch.float32))
    assert surface_ahead(bvh, torch.tensor([0.0, 0.0, 2.0]).double(), torch.tensor([0.0, 0.0, 1.0]).double()) is None
