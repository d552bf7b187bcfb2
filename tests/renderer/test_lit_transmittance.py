"""Shadows that are traced only where a spot's light goes are those of all surfels."""

from __future__ import annotations

import pytest
import torch

from lit_room import HIDDEN, VISIBLE, frozen_room
from rgspipe.renderer.kernels.lit_transmittance import lit_transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import surfel_transmittance


@pytest.fixture(scope="module")
def bvh() -> SurfelBvh:
    return frozen_room().bvh


def test_lit_surfels_have_their_shadows_and_the_others_none(bvh: SurfelBvh) -> None:
    for place in (VISIBLE, HIDDEN):
        position = torch.tensor(place, dtype=torch.float64)
        lit = torch.rand(len(bvh.surfels), generator=torch.Generator().manual_seed(0)) < 0.3
        passing, slope = lit_transmittance(bvh, position, lit)
        everywhere, all_slopes = surfel_transmittance(bvh, position)
        assert bool((everywhere[lit] < 0.5).any()), "some of them must be in shadow for this to prove anything"
        torch.testing.assert_close(passing[lit], everywhere[lit], rtol=0.0, atol=0.0)
        torch.testing.assert_close(slope[lit], all_slopes[lit], rtol=0.0, atol=0.0)
        assert bool((passing[~lit] == 1.0).all()) and bool((slope[~lit] == 0.0).all())


def test_no_surfel_needs_to_be_lit(bvh: SurfelBvh) -> None:
    nothing = torch.zeros(len(bvh.surfels), dtype=torch.bool)
    passing, slope = lit_transmittance(bvh, torch.zeros(3), nothing)
    assert bool((passing == 1.0).all()) and not bool(slope.any())
