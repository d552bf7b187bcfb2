"""Regions against values worked out by hand, and their coverage against draws."""

import math

import numpy as np
import pytest

from rgspipe.fitting.certainty.regions import inside, squared_distance


def test_the_distance_counts_in_standard_deviations():
    matrix = np.diag([4.0, 1.0, 0.25])
    assert squared_distance([2.0, 0.0, 0.5], np.zeros(3), matrix) == (pytest.approx(2.0), 3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    found, known = squared_distance(turn @ [2.0, 0.0, 0.5], np.zeros(3), turn @ matrix @ turn.T)
    assert found == pytest.approx(2.0) and known == 3


def test_what_is_not_determined_says_nothing():
    matrix = np.diag([math.inf, 1.0, 1.0])
    assert squared_distance([9.0, 1.0, 0.0], np.zeros(3), matrix) == (pytest.approx(1.0), 2)
    everything = np.diag([math.inf] * 3)
    assert squared_distance([9.0, 1.0, 0.0], np.zeros(3), everything) == (0.0, 0)
    assert inside([[9.0, 1.0, 0.0]], [np.zeros(3)], [everything])


def test_a_region_without_width_holds_only_the_answer():
    flat = np.diag([1.0, 1.0, 0.0])
    assert squared_distance([1.0, 0.0, 0.0], np.zeros(3), flat)[0] == pytest.approx(1.0)
    assert squared_distance([1.0, 0.0, 0.1], np.zeros(3), flat)[0] == math.inf
    assert not inside([[math.nan, 0.0, 0.0]], [np.zeros(3)], [np.eye(3)])


@pytest.mark.parametrize("lights", [1, 3])
def test_regions_of_all_lights_together_hold_the_truth_in_95_percent(lights):
    generator = np.random.default_rng(1)
    spread = np.diag([1.0, 0.1, 3.0])
    matrices = [spread @ spread] * lights
    draws = [generator.normal(size=(lights, 3)) @ spread for _ in range(2000)]
    share = np.mean([inside(list(draw), [np.zeros(3)] * lights, matrices) for draw in draws])
    assert abs(share - 0.95) < 0.015  # measured 0.949 and 0.95; three standard deviations are 0.0146
