"""Regions against values worked out by hand, and their coverage against draws."""

import math

import numpy as np
import pytest

from rgspipe.evaluation import calibration


def test_the_expected_error_is_that_of_the_worst_light():
    matrices = [np.diag([0.01, 0.01, 0.02]), np.diag([0.04, 0.0, 0.0, 9.0])]
    assert calibration.position_sd(matrices, 2.0) == pytest.approx(0.1)
    assert math.isnan(calibration.position_sd([], 1.0)) and math.isnan(calibration.position_sd(matrices, math.nan))


def test_the_outline_is_the_shadow_of_the_ellipsoid():
    """Points on the surface of the ellipsoid never fall outside the ellipse, and reach it."""
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    matrix = turn @ np.diag([1.0, 0.2, 0.05]) @ turn.T
    across, up, angle = calibration.ellipse(matrix[:2, :2])
    sphere = np.random.default_rng(3).normal(size=(40000, 3))
    sphere *= math.sqrt(7.8147) / np.linalg.norm(sphere, axis=1, keepdims=True)
    seen = (sphere @ np.linalg.cholesky(matrix).T)[:, :2]
    radians = math.radians(angle)
    axes = np.array([[math.cos(radians), math.sin(radians)], [-math.sin(radians), math.cos(radians)]])
    radius = np.linalg.norm(2.0 * (seen @ axes.T) / [across, up], axis=1)
    assert 0.999 < radius.max() < 1.0 + 1e-6 and across > up  # measured 1.0 to 6 digits
    assert calibration.ellipse([[math.inf, 0.0], [0.0, 1.0]]) is None
