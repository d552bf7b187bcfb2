"""Surfels of narrow things are long and narrow, and those of wide ones round."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rgspipe.scene.surfels import quaternion_to_axes
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.extents import extents


def flat(x: np.ndarray, y: np.ndarray) -> Cloud:
    """Points of the plane z = 0, from above."""
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return Cloud(points, np.tile([0.0, 0.0, 1.0], (x.size, 1)))


def test_a_strip_is_as_long_and_as_wide_as_it_is():
    """Turned by 30°; a piece of width w has the deviation w / √12 across."""
    along, across = np.meshgrid(np.linspace(-0.5, 0.5, 201), np.linspace(-0.02, 0.02, 9))
    strip = flat(0.5 * np.sqrt(3.0) * along - 0.5 * across, 0.5 * along + 0.5 * np.sqrt(3.0) * across)
    found = extents(Cloud(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])), strip, 0.1)
    axes = quaternion_to_axes(found.rotations).numpy()[0]
    assert abs(axes[0] @ [0.5 * np.sqrt(3.0), 0.5, 0.0]) == pytest.approx(1.0, abs=1e-6)
    assert axes[2] @ [0.0, 0.0, 1.0] == pytest.approx(1.0, abs=1e-6)
    # Points on both rims stand for half a step more than there is.
    assert found.spread[0] == pytest.approx([1.005 / np.sqrt(12.0), 0.045 / np.sqrt(12.0)], rel=0.02)  # measured 0.0035


def test_a_cell_among_others_is_round():
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 101), np.linspace(-0.5, 0.5, 101))
    middles = np.stack([*(0.1 * part.ravel() for part in np.meshgrid(range(-4, 5), range(-4, 5)))], axis=1)
    centers = Cloud(np.c_[middles, np.zeros(81)], np.tile([0.0, 0.0, 1.0], (81, 1)))
    inner = np.abs(middles).max(axis=1) < 0.35
    assert extents(centers, flat(x, y), 0.1).spread[inner] == pytest.approx(
        0.1 / np.sqrt(12.0), rel=0.1
    )  # measured 0.05


def test_one_point_and_points_in_one_place_have_an_extent():
    alone = Cloud(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
    assert extents(alone, alone, 0.1).spread.min() > 0.0
    spread = extents(alone, Cloud(np.zeros((5, 3)), np.tile([0.0, 0.0, 1.0], (5, 1))), 0.1).spread
    assert np.isfinite(spread).all() and spread.min() > 0.0
    assert torch.isfinite(extents(alone, alone, 0.1).rotations).all()


def test_a_centre_without_points_is_not_narrow():
    """Of two in one place, one gets all points; that of the other is as wide as its spacing says."""
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 9), np.linspace(-0.1, 0.1, 9))
    found = extents(Cloud(np.zeros((2, 3)), np.tile([0.0, 0.0, 1.0], (2, 1))), flat(x, y), 0.1)
    assert sorted(np.isinf(found.spread).all(axis=1)) == [False, True]
    assert torch.isfinite(found.rotations).all()
