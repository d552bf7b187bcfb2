"""Ways along smooth surfaces from surfel to surfel, on shapes where they are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rgspipe.scene.smooth_ways import SmoothWays

#: Distance of surfels.
SPACING = 0.1


def ring(radius: float, height: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Places and outward normals of one ring of a drum, a distance of surfels apart."""
    turn = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * radius / SPACING), endpoint=False)
    normals = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    return radius * normals + np.array([0.0, 0.0, height]), normals


def test_a_way_goes_around_a_drum_from_the_nearer_side() -> None:
    """Half of it was seen: from either end of that half a way leads to the middle of the other."""
    places, normals = ring(1.0)
    seen = places[:, 1] <= 1e-9
    source, length = SmoothWays.among(places, normals, SPACING).sources(seen)
    assert (source[seen] == -1).all() and np.isinf(length[seen]).all()
    beside = ~seen & (np.abs(places[:, 0]) > SPACING)  # in the middle both ways are as long
    assert (places[source[beside], 0] * places[beside, 0] > 0.0).all()
    assert length[~seen].max() == pytest.approx(0.5 * math.pi, rel=0.03)  # measured 0.014


def test_two_sheets_one_above_the_other_are_two_surfaces() -> None:
    """As near as neighbours are, and alike in normals: a step leads along a surface, and not off it."""
    across = np.stack(np.meshgrid(np.arange(8), np.arange(8)), axis=-1).reshape(-1, 2) * SPACING
    places = np.concatenate([np.column_stack([across, np.full(64, height)]) for height in (0.0, SPACING)])
    ways = SmoothWays.among(places, np.tile([0.0, 0.0, 1.0], (128, 1)), SPACING)
    surfaces = ways.surfaces(np.ones(128, dtype=bool))
    assert len(set(surfaces[:64])) == len(set(surfaces[64:])) == 1 and surfaces[0] != surfaces[64]


def test_ways_end_at_their_reach_and_at_what_is_not_of_them() -> None:
    places, normals = ring(1.0)
    ways, count = SmoothWays.among(places, normals, SPACING), len(places)
    chosen = np.ones(count, dtype=bool)
    near = ways.within(np.array([0]), chosen, 3.1 * SPACING)
    assert set(near) == {0, 1, 2, 3, count - 3, count - 2, count - 1}
    chosen[[1, 2]] = False  # farther apart than a step is
    assert set(ways.within(np.array([0]), chosen, 3.1 * SPACING)) == {0, count - 3, count - 2, count - 1}
    assert not len(ways.within(np.empty(0, dtype=np.int64), chosen, np.inf))


def test_surfels_that_are_turned_by_more_than_an_eighth_of_a_circle_lead_nowhere() -> None:
    places, normals = ring(0.1)  # six in a row, 60° from each other
    ways = SmoothWays.among(places, normals, SPACING)
    assert not ways.lead_to(np.ones(len(places), dtype=bool)).any()
