"""Errors of rigs against values worked out by hand."""

import math

import pytest
import torch

from rgspipe.evaluation.rig_errors import match_positions, nearest_position, rig_errors
from rgspipe.scene import PointLight, SpotLight


def _light(x: float, y: float, z: float, brightness: float = 1.0) -> PointLight:
    return PointLight([x, y, z], brightness)


def _spot(x: float, axis: tuple[float, float, float], cone_angle: float) -> SpotLight:
    return SpotLight([x, 0.0, 0.0], 1.0, torch.tensor(axis), "gaussian", cone_angle, 0.1)


def test_lights_are_matched_by_the_smallest_sum_of_distances():
    truth = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [5.0, 0.0, 0.0]]
    estimate = [[5.1, 0.0, 0.0], [0.9, 0.0, 0.0], [0.6, 0.0, 0.0]]
    # Greedily, truth 0 would be left with what is far away.
    assert match_positions(estimate, truth) == ((2, 0), (1, 1), (0, 2))
    assert match_positions(estimate[:1], truth) == ((0, 2),)
    assert match_positions([[math.nan] * 3, [0.0, 0.0, 0.0]], [[0.1, 0.0, 0.0]]) == ((1, 0),)


def test_rig_error_is_that_of_its_worst_light():
    truth = (_light(0, 0, 0), _light(1, 0, 0, 2.0))
    estimate = (_light(1, 0.3, 0, 2.2), _light(0, 0.1, 0))
    errors = rig_errors(estimate, truth, 2.0)
    assert errors.position == pytest.approx(0.15)
    assert errors.intensity == pytest.approx(0.05, abs=1e-6)  # float32 intensities: measured 3e-8 off
    assert errors.pairs == ((1, 0), (0, 1))
    assert rig_errors((), truth, 2.0).position == math.inf


def test_spots_are_judged_by_their_axes_and_cones_too():
    truth = (_spot(0.0, (0, 0, 1), 0.5), _light(1, 0, 0))
    found = (_light(1, 0, 0), _spot(0.1, (0, 1, 1), 0.4))
    errors = rig_errors(found, truth, 1.0)
    assert errors.axis == pytest.approx(45.0) and errors.shape == pytest.approx(math.degrees(0.1), abs=1e-6)
    # A point light in the place of a spot has no axis; among point lights there is none to judge.
    assert rig_errors((_light(0, 0, 0), _light(1, 0, 0)), truth, 1.0).axis == math.inf
    assert math.isnan(rig_errors((_light(1, 0, 0),), (_light(1, 0, 0),), 1.0).axis)
    assert rig_errors((), truth, 1.0).shape == math.inf


def test_the_nearest_of_several_lights_is_found():
    assert nearest_position([1.0, 0.9, 1.0], (_light(0, 0, 0), _light(1, 1, 1))).tolist() == [1.0, 1.0, 1.0]
    assert nearest_position([1.0, 0.9, 1.0], ()) is None
