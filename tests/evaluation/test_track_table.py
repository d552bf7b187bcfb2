"""The table of lights that were followed, against values worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from rgspipe.evaluation.track_table import track_table
from rgspipe.fitting.result import dark_result
from rgspipe.fitting.tracking.frame import FrameStatus, TrackedFrame
from rgspipe.scene.lights import Light, PointLight, SunLight


def _frame(*lights: Light) -> TrackedFrame:
    return TrackedFrame(replace(dark_result(0.0), lights=lights), FrameStatus.TRACKED, 0.1, (0.01,) * len(lights))


def test_suns_are_matched_and_measured_by_where_they_shine_from() -> None:
    angle = math.radians(5.0)
    along, aslant = [0.0, 0.0, -1.0], [math.sin(angle), 0.0, -math.cos(angle)]
    # Each found one is drawn where the other true one is.
    found = SunLight([1.0, 0.0, 0.0], 1.0, along), SunLight([0.0, 0.0, 0.0], 2.0, [1.0, 0.0, 0.0])
    true = SunLight([0.0, 0.0, 0.0], 1.0, aslant), SunLight([1.0, 0.0, 0.0], 2.0, [1.0, 0.0, 0.0])
    table = track_table([_frame(*found)], ["a"], [true], 2.0)
    # Measured: 1e-17, and no degree.
    assert table["position_error"].tolist() == pytest.approx([2.0 * math.sin(0.5 * angle), 0.0], abs=1e-9)
    assert table["axis_error"].tolist() == pytest.approx([5.0, 0.0], abs=1e-9)
    assert table["intensity_error"].tolist() == [0.0, 0.0]


def test_points_are_measured_where_they_stand() -> None:
    found, true = PointLight([0.1, 0.0, 0.2], 1.0), PointLight([0.1, 0.0, 0.0], 2.0)
    table = track_table([_frame(found), _frame()], ["a", "b"], [(true,), (true,)], 2.0)
    assert table["position_error"].tolist()[0] == pytest.approx(0.1) and math.isnan(table["position_error"][1])
    assert table["position_sd"][0] == 0.01
