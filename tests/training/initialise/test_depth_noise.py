"""Noise of a depth map is told from the map alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curved import torus_views
from raycast import room_views
from rgspipe.training.initialise.depth_noise import relative_noise

ROOM = room_views(1, 128)[0].depth.double().numpy()
TORUS = torus_views(1, 128)[0].depth.double().numpy()


@settings(max_examples=20, deadline=None)
@given(noise=st.floats(1e-4, 0.05), seed=st.integers(0, 1000))
def test_noise_is_found_from_edges_and_planes(noise: float, seed: int) -> None:
    noisy = ROOM * (1.0 + noise * np.random.default_rng(seed).standard_normal(ROOM.shape))
    assert relative_noise(noisy) == pytest.approx(noise, rel=0.15)  # measured 1.03 to 1.09: edges add some


@pytest.mark.parametrize("depth", [ROOM, TORUS], ids=["room", "torus"])
def test_edges_and_curves_are_not_noise(depth: np.ndarray) -> None:
    assert relative_noise(depth) < 1e-5  # measured 1e-8 and 1e-6


def test_unknown_pixels_do_not_count() -> None:
    rng = np.random.default_rng(0)
    noisy = ROOM * (1.0 + 0.01 * rng.standard_normal(ROOM.shape))
    noisy[rng.random(ROOM.shape) < 0.2] = np.nan
    assert relative_noise(noisy) == pytest.approx(0.01, rel=0.2)  # measured 1.04


def test_a_map_without_three_known_pixels_in_a_row_says_nothing() -> None:
    assert relative_noise(np.full((5, 5), np.inf)) == 0.0
    assert relative_noise(np.ones((2, 2))) == 0.0
