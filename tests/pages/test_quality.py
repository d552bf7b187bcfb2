"""What a page says of trained surfels beside true ones."""

import math

import pandas as pd
import pytest

from rgspipe.evaluation.held_out import QUALITY
from rgspipe.pages.quality import compared_lights, quality_columns, quality_rows


def _quality() -> pd.DataFrame:
    values = dict.fromkeys(QUALITY, math.nan) | {"psnr": 40.0, "albedo_l1": 0.0123, "count": 10000}
    rows = [{"surfels": name, "light": "pixels"} | values for name in ("trained", "truth")]
    rows[1]["albedo_l1"] = math.nan
    return pd.DataFrame(rows)


def test_measures_are_text_with_units_and_those_that_nobody_has_are_left_out() -> None:
    rows = {row["label"]: row["values"] for row in quality_rows(_quality())}
    assert len(rows) == 3
    assert rows["surfels"] == ["10,000", "10,000"]
    assert rows["albedo: relative error on surfaces"] == ["1.23 %", "—"]
    assert quality_columns(_quality()) == ["trained surfels, light at pixels", "true surfels, light at pixels"]


def _summary(errors: dict[str, float], views: int = 1) -> pd.DataFrame:
    rows = [
        {"method": "search_lm", "views": views, "occlusion": name, "count": 6, "median_position_error": error}
        for name, error in errors.items()
    ]
    return pd.DataFrame(rows)


def test_factors_stand_in_the_order_of_classes_with_all_at_the_end() -> None:
    trained = pd.concat([_summary({"all": 0.004, "occluded": 0.02, "visible": 0.003}), _summary({"all": 0.002}, 3)])
    rows = compared_lights(trained, _summary({"visible": 0.001, "occluded": 0.01, "all": 0.004}))
    assert [row["occlusion"] for row in rows] == ["visible", "occluded", "all"]
    assert [row["factor"] for row in rows] == pytest.approx([3.0, 2.0, 1.0])


def test_without_a_known_error_there_is_no_factor() -> None:
    rows = compared_lights(_summary({"visible": 0.003, "all": math.nan}), _summary({"visible": 0.0, "all": 0.1}))
    assert all(math.isnan(row["factor"]) for row in rows)
    assert compared_lights(_summary({"all": 0.1}), _summary({}).reindex(columns=["method"])) == []
