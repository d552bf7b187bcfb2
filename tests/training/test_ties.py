"""Guessed surfaces while albedo is solved: one unknown each, pulled to what was seen in their plane."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.scene import Surfels
from rgspipe.training.ties import Ties
from rooms import closed_box


@pytest.fixture
def room() -> Surfels:
    """A box whose floor is half a guess, and whose wall x = −½ is all of one."""
    box = closed_box(0.1).to(torch.float32)
    guessed = (box.normals[:, 2] > 0.9) & (box.centers[:, 0] > 0.0) | (box.normals[:, 0] > 0.9)
    return replace(box, guessed=guessed.to(box.centers))


def test_summed_is_the_transpose_of_spread_and_seen_surfels_stay_alone(room):
    ties, generator = Ties(room), torch.Generator().manual_seed(0)
    values = torch.rand(len(room), 3, generator=generator)
    unknowns = torch.rand(ties.summed(values).shape, generator=generator)
    assert len(unknowns) == int((room.guessed == 0.0).sum()) + 2
    a, b = (ties.spread(unknowns) * values).double().sum(), (unknowns * ties.summed(values)).double().sum()
    assert float(a) == pytest.approx(float(b), rel=1e-6)  # measured 1e-8
    assert len(ties.spread(unknowns)[room.guessed > 0.0].unique(dim=0)) == 2


def test_solves_start_with_the_plane_or_the_mean(room):
    albedo = torch.rand(len(room), 3, generator=torch.Generator().manual_seed(1))
    started, floor = Ties(room).started(albedo), room.normals[:, 2] > 0.9
    seen, wall = room.guessed == 0.0, room.normals[:, 0] > 0.9
    assert torch.equal(started[seen], albedo[seen])
    assert torch.equal(started[floor & ~seen].unique(dim=0)[0], albedo[floor & seen].median(dim=0).values)
    torch.testing.assert_close(started[wall][0], albedo[wall].mean(dim=0))


def test_a_wall_of_which_nothing_was_seen_is_not_pulled(room):
    expected, variance = Ties(room).expected(room.albedo)
    wall, floor = room.normals[:, 0] > 0.9, (room.normals[:, 2] > 0.9) & (room.guessed > 0.0)
    assert bool(variance[wall].isinf().all()) and bool((variance[floor] > 0.0).all())
    assert bool(expected.isfinite().all())


def test_what_pulls_at_a_guessed_surface_counts_once(room):
    weight = Ties(room).once(torch.full((len(room), 1), 2.0))
    assert bool((weight[room.guessed == 0.0] == 2.0).all())
    for surface in (room.normals[:, 0] > 0.9, (room.normals[:, 2] > 0.9) & (room.guessed > 0.0)):
        assert float(weight[surface].sum()) == pytest.approx(2.0, rel=1e-5)  # measured 1e-7
