"""Views confirm facets on the surface, see through those before it, and know nothing of those behind it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from raycast import room_views
from rgspipe.degradation.degraded_views import degraded
from rgspipe.degradation.options import ViewErrors
from rgspipe.training.initialise.facets import Facets
from rgspipe.training.initialise.visibility import confirmed

NOISE = 0.01


def facets_at(height: float) -> Facets:
    """Facets that face up over the free part of the room's floor, which is at −0.5."""
    x, y = (grid.reshape(-1) for grid in np.meshgrid(np.linspace(0.2, 0.45, 12), np.linspace(-0.45, 0.45, 20)))
    count = len(x)
    return Facets(
        np.stack([x, y, np.full(count, height - 0.5)], axis=1),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.ones(count),
        np.zeros((count, 3, 3)),
        np.ones(count, dtype=bool),
    )


@pytest.fixture(scope="module")
def views():
    return degraded(room_views(30, 64), ViewErrors(depth_noise=NOISE))


@pytest.mark.parametrize("height, share", [(0.0, 1.0), (0.08, 0.0), (-0.08, 0.0)], ids=["on", "before", "behind"])
def test_only_facets_on_the_surface_are_confirmed(views, height: float, share: float) -> None:
    found = confirmed(facets_at(height), views, [NOISE] * len(views)).mean()
    assert found == pytest.approx(share, abs=0.05)  # measured 1, 0, 0


def test_unknown_depth_neither_confirms_nor_refutes(views) -> None:
    blind = [replace(view, depth=torch.full_like(view.depth, torch.nan)) for view in views]
    noise = [NOISE] * len(views)
    assert not confirmed(facets_at(0.0), blind, noise).any()
    on = facets_at(0.0)
    assert (confirmed(on, [*views, *blind], noise * 2) == confirmed(on, views, noise)).all()


def test_no_surface_behind_a_facet_refutes_it(views) -> None:
    empty = [replace(view, depth=torch.full_like(view.depth, torch.inf)) for view in views]
    assert not confirmed(facets_at(0.0), empty, [NOISE] * len(views)).any()
