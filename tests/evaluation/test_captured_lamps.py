"""Lamps that were found beside those that were on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from raycast import BLOCK, ROOM, view_of
from rgspipe.evaluation.captured_lamps import against_truth
from rgspipe.scene import PointLight

VIEW = view_of([ROOM, BLOCK], (0.4, -0.4, 0.4), (-0.1, 0.1, -0.3), 32)

#: In the middle of the room, and behind the block.
TRUE = (PointLight([0.0, 0.0, 0.1], [2.0, 2.0, 2.0]), PointLight([-0.3, 0.35, -0.4], [1.0, 1.0, 1.0]))


def test_lamps_are_matched_and_measured() -> None:
    found = (PointLight([-0.3, 0.35, -0.3], [1.0, 1.1, 1.2]), PointLight([0.0, 0.01, 0.1], [1.8, 1.8, 1.8]))
    places = np.stack([0.01**2 * np.eye(3)] * 2)
    told = against_truth(found, places, TRUE, 2.0, [VIEW])
    assert told["lamps"] == 2
    assert told["position_error"] == pytest.approx([0.05, 0.005])
    assert told["intensity_ratio"] == pytest.approx([1.1, 0.9])
    assert told["stated"] == pytest.approx([3**0.5 * 0.005] * 2)
    # Ten and one standard deviations; a ball of 95 % reaches 2.8.
    assert told["inside_95"] == [False, True]
    assert told["in_sight"] == [False, True] and told["missed_in_sight"] == []
    missed = against_truth(found[:1], places[:1], TRUE, 2.0, [VIEW])
    assert missed["in_sight"] == [False] and missed["missed_in_sight"] == [True]


def test_a_lamp_outside_of_the_image_is_in_no_sight() -> None:
    behind = PointLight([0.45, -0.45, 0.45], [1.0, 1.0, 1.0])
    places = np.eye(3)[None]
    assert against_truth([behind], places, (behind,), 1.0, [VIEW])["in_sight"] == [False]
    blind = replace(VIEW, depth=None)
    assert against_truth([TRUE[1]], places, TRUE[1:], 1.0, [blind])["in_sight"] == [True]
    assert torch.isfinite(VIEW.depth).all()
