"""The few figures at the top of pages."""

import json
import math

import pytest

from rgspipe.pages.highlights import NAMES, highlights, tiles
from rgspipe.pages.overview import scene_summary


def test_highlights_are_those_of_the_frozen_scene_and_of_one_view(full_contents):
    found = highlights(full_contents.quality, full_contents.summary, full_contents.true_summary, full_contents.training)
    assert set(found) == set(NAMES)
    assert found["psnr"] == 38.25 and found["true_psnr"] == 38.25
    one = full_contents.summary.query("views == 1 and occlusion == 'all'").iloc[0]
    assert found["position_error"] == one["median_position_error"] and found["targets"] == 9
    true = full_contents.true_summary.query("occlusion == 'all'").iloc[0]
    assert found["true_position_error"] == true["median_position_error"]
    shown = {tile["label"]: (tile["value"], tile["beside"]) for tile in tiles(found)}
    assert shown["PSNR of held-out views"] == ("38.2 dB", "true surfels: 38.2 dB")
    assert shown["training"] == ("200 s", "")


def test_without_a_judgement_training_speaks_for_itself(full_contents):
    found = highlights(None, full_contents.summary.iloc[:0], None, {"test_psnr_mean": 36.5})
    assert found["psnr"] == 36.5
    assert {name for name, value in found.items() if value is not None} == {"psnr"}
    assert [tile["label"] for tile in tiles(found)] == ["PSNR of held-out views"]


def test_where_most_fits_failed_the_error_is_told_and_not_left_out(full_contents):
    summary = full_contents.summary.assign(median_position_error=math.inf, median_intensity_error=math.inf)
    found = highlights(full_contents.quality, summary, full_contents.true_summary, full_contents.training)
    shown = {tile["label"]: tile["value"] for tile in tiles(found)}
    assert shown["lights: median position error"] == "∞" and found["intensity_error"] == math.inf


def test_a_scenes_summary_is_strict_json_with_a_row_for_each_class(full_contents):
    full_contents.summary.loc[full_contents.summary["occlusion"] == "occluded", "median_position_error"] = math.inf
    summary = json.loads(json.dumps(scene_summary(full_contents), allow_nan=False))
    rows = {row["occlusion"]: row for row in summary["lights"]}
    assert list(rows) == ["visible", "out_of_frame", "occluded"]
    assert rows["occluded"]["position_error"] == "inf" and rows["visible"]["count"] == 3
    true = full_contents.true_summary.query("occlusion == 'visible'").iloc[0]
    assert rows["visible"]["true_position_error"] == pytest.approx(true["median_position_error"])
