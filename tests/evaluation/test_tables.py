"""Tables against values worked out by hand."""

import math

import numpy as np
import pandas as pd
import pytest
import torch

from rgspipe.evaluation.summary import SUMMARY_COLUMNS, summary_table
from rgspipe.evaluation.tables import TARGET_COLUMNS, VARIANCES, exemplars, target_table
from rgspipe.scene import PointLight, SpotLight


def _light(x: float, y: float, z: float, brightness: float = 1.0) -> PointLight:
    return PointLight(torch.tensor([x, y, z]), torch.full((3,), brightness))


def _spot(x: float, axis: tuple[float, float, float], cone_angle: float) -> SpotLight:
    position, intensity = torch.tensor([x, 0.0, 0.0]), torch.ones(3)
    return SpotLight(position, intensity, torch.tensor(axis), "gaussian", cone_angle, 0.1)


def _results(names: list[tuple[str, str]], **more: object) -> pd.DataFrame:
    rows = [{"target": name, "occlusion": kind, "method": "search_lm", "views": 1} for name, kind in names]
    return pd.DataFrame(rows).assign(seconds=2.0, psnr=30.0, result="converged", reason="small step", **more)


def test_the_number_of_lights_is_targets():
    truths = {name: (_light(0, 0, 0),) for name in "ab"}
    estimates = {"a": (_light(0, 0, 0),), "b": (_light(0, 0, 0), _light(1, 1, 1))}
    table = target_table(_results([("a", "visible"), ("b", "visible")]), estimates, truths, 1.0)
    assert table["count_right"].tolist() == [True, False]
    assert summary_table(table, seed=0)["count_rate"].tolist() == [0.5, 0.5]


def test_the_types_of_lights_are_judged_where_their_number_is_right():
    rig = (_spot(0.0, (0, 0, 1), 0.5), _light(1, 0, 0))
    found = {"a": rig[::-1], "b": (_light(0, 0, 0), _spot(1.0, (0, 0, 1), 0.5)), "c": rig[:1], "d": rig}
    results = _results([(name, "visible") for name in found])
    table = target_table(results, found, dict.fromkeys("abc", rig), 1.0)
    # "b" has a spot and a point, but each in the place of the other; of "d" the truth is not known.
    assert table["types_right"].tolist()[:3] == [True, False, False] and pd.isna(table["types_right"][3])
    assert table["count_right"].tolist()[:3] == [True, True, False]
    assert summary_table(table, seed=0)["types_rate"].tolist() == pytest.approx([1 / 3, 1 / 3])


def test_target_table_holds_errors_verdicts_and_both_positions():
    results = _results([("a", "visible"), ("b", "occluded"), ("c", "occluded"), ("d", "visible")])
    estimates = {"a": (_light(0.5, 0.5, 0.51, 1.1),), "b": (_light(0.5, 0.5, 0.9),), "d": (_light(0, 0, 0),)}
    truths = {name: (_light(0.5, 0.5, 0.5),) for name in "abc"}
    table = target_table(results, estimates, truths, 2.0).set_index("target")
    assert list(table.reset_index().columns) == list(TARGET_COLUMNS)
    assert table.loc["a", "position_error"] == pytest.approx(0.005, abs=1e-7)
    assert table.loc["a", "intensity_error"] == pytest.approx(0.1, abs=1e-6)
    assert bool(table.loc["a", "success"]) and not bool(table.loc["b", "success"])
    assert table.loc["b", "position_error"] == pytest.approx(0.2, abs=1e-7)
    assert table.loc["c", "position_error"] == math.inf and not bool(table.loc["c", "success"])
    assert math.isnan(table.loc["d", "position_error"]) and pd.isna(table.loc["d", "success"])
    assert table.loc["a", ["z", "z_true"]].tolist() == pytest.approx([0.51, 0.5], abs=1e-6)


def test_a_light_too_many_is_no_success():
    truths = {"a": (_light(0, 0, 0),)}
    table = target_table(_results([("a", "visible")]), {"a": (_light(0, 0, 0), _light(1, 1, 1))}, truths, 1.0)
    assert table["position_error"].iloc[0] == 0.0 and not bool(table["success"].iloc[0])


def test_an_unknown_scene_size_leaves_intensity_errors():
    table = target_table(
        _results([("a", "visible")]), {"a": (_light(0, 0, 0, 2.0),)}, {"a": (_light(1, 0, 0),)}, math.nan
    )
    assert math.isnan(table["position_error"].iloc[0]) and table["intensity_error"].iloc[0] == pytest.approx(1.0)


def test_results_without_a_needed_column_are_refused():
    with pytest.raises(ValueError, match="seconds"):
        target_table(_results([("a", "visible")]).drop(columns="seconds"), {}, {}, 1.0)


def _targets() -> pd.DataFrame:
    names = [(f"v{i}", "visible") for i in range(5)] + [(f"o{i}", "occluded") for i in range(3)]
    errors = [0.001, 0.002, 0.003, 0.004, 0.5, 0.02, math.inf, math.nan]
    truths = {name: (_light(0, 0, 0),) for (name, _), error in zip(names, errors, strict=True) if not math.isnan(error)}
    estimates = {
        name: (_light(error, 0, 0),) for (name, _), error in zip(names, errors, strict=True) if math.isfinite(error)
    }
    return target_table(_results(names), estimates, truths, 1.0)


def test_summary_has_medians_worst_and_rates_per_class_and_over_all():
    summary = summary_table(_targets(), seed=3)
    assert list(summary.columns) == list(SUMMARY_COLUMNS)
    assert summary["occlusion"].tolist() == ["visible", "occluded", "all"]
    rows = summary.set_index("occlusion")
    assert rows.loc["visible", "median_position_error"] == pytest.approx(0.003, abs=1e-8)
    assert rows.loc["visible", "worst_position_error"] == pytest.approx(0.5)
    assert rows.loc["visible", "success_rate"] == pytest.approx(0.8)
    assert rows.loc["visible", "median_low"] <= 0.003 <= rows.loc["visible", "median_high"]
    assert rows.loc["occluded", ["count", "with_truth"]].tolist() == [3, 2]
    assert rows.loc["occluded", "median_position_error"] == math.inf  # one of two fits failed
    assert rows.loc["all", ["count", "with_truth"]].tolist() == [8, 7]
    assert rows.loc["all", "median_seconds"] == 2.0
    pd.testing.assert_frame_equal(summary, summary_table(_targets(), seed=3))


def test_summary_without_truth_or_without_targets():
    unknown = summary_table(target_table(_results([("a", "unknown")]), {}, {}, 1.0), seed=0)
    assert unknown["with_truth"].tolist() == [0, 0] and unknown["success_rate"].isna().all()
    assert unknown["median_psnr"].tolist() == [30.0, 30.0]
    empty = target_table(_results([("a", "visible")]).iloc[:0], {}, {}, 1.0)
    assert summary_table(empty, seed=0).empty and exemplars(empty) == {}


def test_exemplars_are_the_median_and_the_worst_of_each_class():
    chosen = exemplars(_targets())
    assert chosen == {"visible": {"median": "v2", "worst": "v4"}, "occluded": {"median": "o0", "worst": "o1"}}


def test_exemplars_without_truth_go_by_psnr():
    results = _results([("a", "unknown"), ("b", "unknown"), ("c", "unknown")]).assign(psnr=[20.0, 40.0, 30.0])
    chosen = exemplars(target_table(results, {}, {}, 1.0))
    assert chosen == {"unknown": {"median": "c", "worst": "a"}}


def test_what_noise_allows_is_compared_with_the_limit_where_it_is_known():
    names = [("much", "visible"), ("little", "visible"), ("unknown", "visible")]
    truths = {name: (_light(0, 0, 0),) for name, _ in names}
    spread = np.diag([1e-4, 4e-4, 4e-4, 1.0])
    bounds = {"much": [spread], "little": [0.1 * spread]}
    table = target_table(_results(names), truths, truths, 2.0, 0.01, noise_bounds=bounds).set_index("target")
    assert table["noise_sd"].tolist()[:2] == pytest.approx([0.015, 0.015 * math.sqrt(0.1)])
    assert table.loc[["much", "little"], "noise_allows"].tolist() == [False, True]
    assert math.isnan(table.loc["unknown", "noise_sd"]) and table.loc[["unknown"], "noise_allows"].isna().all()
    assert table["position_sd"].isna().all()


def test_regions_are_judged_where_truth_and_covariance_are_known():
    names = [("in", "visible"), ("out", "visible"), ("silent", "visible"), ("many", "visible")]
    truths = {name: (_light(0, 0, 0),) for name, _ in names}
    estimates = {name: (_light(0.02, 0, 0),) for name, _ in names} | {"many": (_light(0, 0, 0), _light(1, 1, 1))}
    spread = np.diag([1e-4, 4e-4, 4e-4, 1.0])
    covariances = {"in": [spread], "out": [0.1 * spread], "many": [spread, spread]}
    table = target_table(_results(names), estimates, truths, 2.0, covariances=covariances).set_index("target")
    assert table.loc[["in", "out"], "inside_95"].tolist() == [True, False]
    assert table.loc[["silent", "many"], "inside_95"].isna().all()
    assert table.loc["in", "position_sd"] == pytest.approx(0.5 * math.sqrt(9e-4))
    assert table.loc["in", list(VARIANCES)].tolist() == pytest.approx([1e-4, 0, 0, 4e-4, 0, 4e-4])
    assert math.isnan(table.loc["silent", "position_sd"]) and table.loc["silent", list(VARIANCES)].isna().all()
    summary = summary_table(table.reset_index(), seed=0, resamples=0).set_index("occlusion")
    assert summary.loc["visible", "inside_95"] == pytest.approx(0.5)
