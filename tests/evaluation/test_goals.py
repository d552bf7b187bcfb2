"""What is wanted against what was measured: reached, missed, not measured."""

import math

import pandas as pd

from rgspipe.evaluation import goals
from rgspipe.evaluation.classes import ALL
from rgspipe.evaluation.summary import SUMMARY_COLUMNS

METHOD = "search_lm"


def _summary(**medians: float) -> pd.DataFrame:
    """Rows of class_views, each median with an interval of ± 0.0002."""
    rows = []
    for key, median in medians.items():
        occlusion, views = key.rsplit("_", 1)
        row = dict.fromkeys(SUMMARY_COLUMNS, math.nan) | {"method": METHOD, "views": int(views)}
        row |= {"occlusion": occlusion, "count": 20, "with_truth": 20, "median_position_error": median}
        row |= {"median_low": median - 0.0002, "median_high": median + 0.0002}
        rows.append(row | {"median_seconds": 1.0, "worst_seconds": 6.0})
    return pd.DataFrame(rows, columns=list(SUMMARY_COLUMNS))


def _found(scene: str = "cornell", training: dict | None = None, **medians: float) -> dict[str, bool | None]:
    return {goal.name: goal.met for goal in goals.goals(scene, _summary(**medians), training, METHOD)}


def test_each_goal_is_met_or_missed_by_its_own_figure():
    training = {"test_psnr_mean": 43.4, "seconds": 100.0}
    found = _found("cornell", training, visible_1=0.0009, occluded_1=0.0044, occluded_3=0.0017, all_1=0.02, all_3=0.01)
    assert list(found.values()) == [False, True, True, None, False, True, True, True]


def test_a_median_may_be_worse_by_its_interval():
    name = "Visible light, one view: median position error"
    assert _found(visible_1=0.0013)[name] and not _found(visible_1=0.0014)[name]


def test_what_was_not_measured_is_neither_met_nor_missed():
    found = goals.goals("corner", _summary(), None, METHOD)
    assert {goal.met for goal in found} == {None} and {goal.found for goal in found} == {goals.MISSING}


def test_a_scene_that_was_never_measured_has_no_goals():
    assert _found("a folder of mine", visible_1=0.5) == {}


def test_few_targets_neither_meet_a_goal_nor_miss_it():
    summary = _summary(visible_1=0.001, occluded_1=0.5, all_1=0.01, all_3=0.02)
    summary["with_truth"] = 19
    found = goals.goals("cornell", summary, None, METHOD)
    assert {goal.met for goal in found if "median position" in goal.name} == {None}


def test_a_study_of_kinds_of_lights_has_goals_of_its_own():
    row = {"case": "two lights, 3 views", "method": METHOD, "occlusion": ALL, "with_truth": 40}
    row |= {"position": 0.0033, "position_low": 0.0024, "position_high": 0.0043}
    other = row | {"case": "two lights, 3 views, true scene", "position_low": 0.9}
    found = goals.goals("void", _summary(), None, METHOD, pd.DataFrame([row, other]))
    assert [(goal.name, goal.met) for goal in found] == [
        ("Kinds of lights, two lights, 3 views: median position error", True)
    ]


def test_the_preferred_method_is_taken_if_it_was_run():
    assert goals.primary_method(_summary(all_1=0.1)) == "search_lm"
    assert goals.primary_method(_summary(all_1=0.1).assign(method="paper_adam")) == "paper_adam"
    assert goals.primary_method(_summary()) == "search_lm"
