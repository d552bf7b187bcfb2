"""Regions against values worked out by hand, and their coverage against draws."""

import math

import numpy as np
import pytest

from rgspipe.evaluation import calibration


def test_the_distance_counts_in_standard_deviations():
    matrix = np.diag([4.0, 1.0, 0.25])
    assert calibration.squared_distance([2.0, 0.0, 0.5], np.zeros(3), matrix) == (pytest.approx(2.0), 3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    found, known = calibration.squared_distance(turn @ [2.0, 0.0, 0.5], np.zeros(3), turn @ matrix @ turn.T)
    assert found == pytest.approx(2.0) and known == 3


def test_what_is_not_determined_says_nothing():
    matrix = np.diag([math.inf, 1.0, 1.0])
    assert calibration.squared_distance([9.0, 1.0, 0.0], np.zeros(3), matrix) == (pytest.approx(1.0), 2)
    everything = np.diag([math.inf] * 3)
    assert calibration.squared_distance([9.0, 1.0, 0.0], np.zeros(3), everything) == (0.0, 0)
    assert calibration.inside([[9.0, 1.0, 0.0]], [np.zeros(3)], [everything])
    assert calibration.position_sd([everything], 1.0) == math.inf


def test_a_region_without_width_holds_only_the_answer():
    flat = np.diag([1.0, 1.0, 0.0])
    assert calibration.squared_distance([1.0, 0.0, 0.0], np.zeros(3), flat)[0] == pytest.approx(1.0)
    assert calibration.squared_distance([1.0, 0.0, 0.1], np.zeros(3), flat)[0] == math.inf
    assert not calibration.inside([[math.nan, 0.0, 0.0]], [np.zeros(3)], [np.eye(3)])


@pytest.mark.parametrize("lights", [1, 3])
def test_regions_of_all_lights_together_hold_the_truth_in_95_percent(lights):
    generator = np.random.default_rng(1)
    spread = np.diag([1.0, 0.1, 3.0])
    matrices = [spread @ spread] * lights
    draws = [generator.normal(size=(lights, 3)) @ spread for _ in range(2000)]
    share = np.mean([calibration.inside(list(draw), [np.zeros(3)] * lights, matrices) for draw in draws])
    assert abs(share - 0.95) < 0.015  # measured 0.949 and 0.95; three standard deviations are 0.0146


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
