"""Tables of single runs become one."""

import math

import pandas as pd
import pytest

from rgspipe.evaluation.held_out import QUALITY
from rgspipe.studies.captures import TRUTH, study_row, with_factors


def _quality(psnr: float) -> pd.DataFrame:
    row = dict.fromkeys(QUALITY, 0.5) | {"psnr": psnr}
    return pd.DataFrame([{"light": "centres"} | row | {"psnr": 0.0}, {"light": "pixels"} | row])


def _lights(error: float) -> pd.DataFrame:
    rows = [("all", error), ("visible", 0.5 * error), ("occluded", 2 * error)]
    table = pd.DataFrame(rows, columns=["occlusion", "median_position_error"])
    return table.assign(median_intensity_error=0.02, success_rate=0.75)


def test_a_row_takes_light_at_pixels_and_all_classes() -> None:
    row = study_row("cornell", "clean", _quality(40.0), _lights(0.01))
    assert row["psnr"] == 40.0 and row["position_error"] == 0.01 and row["solved"] == 0.75
    assert [key for key in row if key.startswith("position_error_")] == [
        "position_error_visible",
        "position_error_occluded",
    ]


def test_factors_are_over_the_true_surfels_of_the_same_scene() -> None:
    rows = [
        study_row(scene, case, _quality(40.0), _lights(error))
        for scene, case, error in [
            ("cornell", "clean", 0.01),
            ("cornell", TRUTH, 0.005),
            ("room", "clean", 0.03),
            ("room", TRUTH, 0.01),
            ("external", "clean", 0.03),
        ]
    ]
    factors = with_factors(pd.DataFrame(rows))["factor"].tolist()
    assert factors[:4] == pytest.approx([2.0, 1.0, 3.0, 1.0]) and math.isnan(factors[4])


def test_scenes_without_targets_have_no_errors_of_lights() -> None:
    empty = _lights(0.01).iloc[:0]
    table = with_factors(
        pd.DataFrame(
            [study_row("s", "clean", _quality(40.0), _lights(0.01)), study_row("t", "clean", _quality(30.0), empty)]
        )
    )
    assert math.isnan(table["position_error"][1]) and math.isnan(table["factor"][1])
