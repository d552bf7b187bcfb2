"""The table of a study: medians, shares with intervals, and what counts as wrong without a word."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from rgspipe.fitting.result import FitStatus
from rgspipe.studies.light_table import markdown, shown_rows
from rgspipe.studies.lights import STATUSES, case_rows, predicted_errors, several, wilson_interval


def _targets(views: int = 1) -> pd.DataFrame:
    """Four targets: solved; missed but within its region; missed silently; ambiguous."""
    table = pd.DataFrame(
        {
            "target": ["a", "b", "c", "d"],
            "occlusion": ["visible", "visible", "occluded", "occluded"],
            "position_error": [0.002, 0.02, 0.03, math.inf],
            "intensity_error": [0.01, 0.02, 0.03, 0.04],
            "seconds": [1.0, 2.0, 3.0, 4.0],
            "success": pd.array([True, False, False, False], dtype="boolean"),
            "inside_95": pd.array([True, True, False, pd.NA], dtype="boolean"),
            "position_sd": [0.002, 0.02, 0.001, math.nan],
            "noise_sd": [0.001, 0.015, 0.0005, math.nan],
            "noise_allows": pd.array([True, False, True, pd.NA], dtype="boolean"),
            "result": ["converged", "converged", "converged", "ambiguous"],
            "axis_error": [math.nan, 0.5, 1.5, math.nan],
            "shape_error": math.nan,
            "shape_kind": None,
            "count_right": pd.array([True, True, True, False], dtype="boolean"),
            "types_right": pd.array([True, False, True, False], dtype="boolean"),
        }
    )
    return table.assign(method="search_lm", views=views)


def test_statuses_are_those_of_fits() -> None:
    assert set(STATUSES) == {str(status) for status in FitStatus}


def test_a_case_has_a_row_for_each_class_and_one_for_all() -> None:
    rows = case_rows("cornell", "clean", _targets(), seed=0, resamples=500)
    assert rows["occlusion"].tolist() == ["visible", "occluded", "all"]
    whole = rows.iloc[2]
    assert whole["count"] == whole["with_truth"] == 4 and whole["position"] == pytest.approx(0.025)
    assert whole["position_low"] == 0.002 and whole["position_high"] == math.inf
    assert (whole["success"], whole["inside_95"]) == (0.25, pytest.approx(2 / 3))
    assert whole["noise"] == 0.001 and whole["noise_allows"] == pytest.approx(2 / 3)
    assert whole["stated"] == 0.002 and whole["converged"] == 0.75 and whole["ambiguous"] == 0.25
    assert whole["axis"] == 1.0 and math.isnan(whole["shape"]) and whole["right_number"] == 0.75
    assert whole["right_types"] == 0.5
    # Only "c" says converged, is off and states no region with the truth.
    assert rows["silent"].tolist() == [0.0, 0.5, 0.25]


def test_a_row_does_not_depend_on_the_others() -> None:
    both = case_rows("s", "c", pd.concat([_targets(1), _targets(2).assign(seconds=9.0)]), seed=0, resamples=200)
    alone = case_rows("s", "c", _targets(1), seed=0, resamples=200)
    pd.testing.assert_frame_equal(both[both["views"] == 1], alone)


def test_without_truth_there_are_no_errors_and_nothing_is_silent() -> None:
    unknown = _targets().assign(position_error=math.nan, intensity_error=math.nan, success=pd.NA, inside_95=pd.NA)
    whole = case_rows("s", "c", unknown, seed=0, resamples=100).iloc[-1]
    assert whole["with_truth"] == 0 and whole[["position", "position_low", "success", "silent"]].isna().all()
    assert whole["seconds"] == 2.5


@pytest.mark.parametrize(
    ("successes", "count", "low", "high"),
    # Values of Wilson's interval for 0, 5 and 10 of 10 as tabulated by Newcombe (1998), to three digits.
    [(0, 10, 0.0, 0.278), (5, 10, 0.237, 0.763), (10, 10, 0.722, 1.0)],
)
def test_shares_have_intervals_of_wilson(successes: int, count: int, low: float, high: float) -> None:
    assert wilson_interval(successes, count) == pytest.approx((low, high), abs=5e-4)


def test_an_interval_of_nothing_is_not_known() -> None:
    assert all(math.isnan(end) for end in wilson_interval(0, 0))


def test_predictions_are_medians_of_what_first_fits_foretell() -> None:
    advice = {
        name: pd.DataFrame({"views": [2, 3], "position_sd": [sd, sd / 2]})
        for name, sd in (("a", 0.001), ("b", 0.003), ("c", math.inf))
    }
    found = predicted_errors(_targets(), advice).set_index(["views", "occlusion"])["predicted"]
    assert found[2, "visible"] == pytest.approx(0.002) and found[3, "visible"] == pytest.approx(0.001)
    assert found[1, "all"] == pytest.approx(0.002) and found[2, "all"] == pytest.approx(0.003)
    assert found[2, "occluded"] == math.inf


def test_errors_of_shapes_have_the_unit_of_their_kind_and_of_several_kinds_none() -> None:
    told = _targets().assign(shape_error=[0.01, 0.02, 0.03, math.nan])
    for kinds, shape in ((["sphere"] * 4, "0.0200 (0.0100–0.0300)"), (["spot"] * 4, "0.02° (0.01–0.03)")):
        table = case_rows("cornell", "clean", told.assign(shape_kind=kinds), seed=0, resamples=500)
        assert table["shape_kind"].tolist() == kinds[:1] * 3 and shown_rows(table, "kinds")[1][0]["shape"] == shape
    table = case_rows("cornell", "clean", told.assign(shape_kind=["led", "led", "spot", None]), seed=0, resamples=500)
    # Both visible ones are LEDs.
    assert table["shape_kind"].dropna().tolist() == ["led", "spot"] and table["shape"].tolist()[:2] == [0.015, 0.03]
    assert pd.isna(table["shape_kind"].iloc[-1])
    assert shown_rows(table, "kinds")[1][0]["shape"] == "—"


def test_text_shows_what_differs_and_says_what_is_not_known() -> None:
    table = case_rows("cornell", "noise 3 %", _targets(), seed=0, resamples=100)
    headings, rows = shown_rows(table, "robustness")
    assert len(rows) == 1 and headings[0] == "case" and "scene" not in headings and "light" not in headings
    assert rows[0]["case"] == "noise 3 %" and rows[0]["says"] == "converged 75 %, ambiguous 25 %"
    assert rows[0]["silent"].startswith("25 % (") and rows[0]["solved"].startswith("25 % (5–70")
    text = markdown(pd.concat([table, table.assign(scene="corner")]), "classes")
    assert text.startswith("| scene | views | light |") and text.count("\n") == 8 and "| corner |" in text
    headings, rows = shown_rows(table, "kinds")
    assert len(rows) == 1 and rows[0]["axis"] == "1.00° (0.50–1.50)" and rows[0]["shape"] == "—"
    assert rows[0]["right number"].startswith("75 %") and rows[0]["right types"].startswith("50 %")
    assert rows[0]["truth in 95 % region"].count("–") == 0
    (row,) = shown_rows(table, "regions")[1]
    assert row["truth in 95 % region"].count("–") == 1
    # A study that was made before types were judged, or before kinds were told, can still be shown.
    assert "right types" not in shown_rows(table.drop(columns="right_types"), "kinds")[0]
    assert "shape" not in shown_rows(table.drop(columns="shape_kind"), "kinds")[0]
    table = pd.concat([table, table.assign(views=2, predicted=0.01, position=math.inf)])
    headings, rows = shown_rows(table, "views")
    assert rows[-1]["predicted"] == "1.00 %" and rows[0]["predicted"] == "—" and rows[-1]["position error"][0] == "∞"


def test_text_does_not_repeat_a_single_class() -> None:
    targets = _targets()
    table = case_rows("corner", "", targets[targets["occlusion"] == "occluded"], seed=0, resamples=0)
    assert len(table) == 2
    assert [row["light"] for row in shown_rows(table, "views")[1]] == ["occluded"]


def test_columns_that_do_not_differ_are_left_out() -> None:
    table = pd.DataFrame({"a": [1, 2], "b": [1, 1]})
    assert several(table, ["a", "b"]) == ["a"]
