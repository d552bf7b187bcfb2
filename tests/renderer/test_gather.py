"""The gather operator: rows are shares of a hemisphere, the same for a seed, with exact sums after reciprocity."""

from __future__ import annotations

import pytest
import torch

from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.rectangles import inside_of_box, surfels_on


@pytest.fixture(scope="module")
def bvh() -> SurfelBvh:
    return SurfelBvh(surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]), 600).to(torch.float32))


@pytest.mark.parametrize("reciprocal", [False, True])
def test_rows_are_shares_of_a_hemisphere(bvh: SurfelBvh, reciprocal: bool) -> None:
    gather = build_gather(bvh, 64, seed=0, areas=surfel_areas(bvh, seed=0) if reciprocal else None)
    rows = gather.matrix @ torch.ones(len(bvh.surfels), 1)
    # Closed: all of the hemisphere is surface. Measured 1 ± 1e-6.
    torch.testing.assert_close(rows, torch.ones_like(rows), rtol=1e-5, atol=0)
    assert float(gather.matrix.values().min()) >= 0.0


def test_a_seed_repeats_it(bvh: SurfelBvh) -> None:
    first, second = (build_gather(bvh, 64, seed=3) for _ in range(2))
    assert torch.equal(first.matrix.values(), second.matrix.values())
