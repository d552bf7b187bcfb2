"""Promises against measurements: met, missed, not measured."""

import math

import pandas as pd

from rgspipe.evaluation import goals, tables


def _summary(**medians: float) -> pd.DataFrame:
    rows = []
    for key, median in medians.items():
        occlusion, views = key.rsplit("_", 1)
        row = dict.fromkeys(tables.SUMMARY_COLUMNS, math.nan) | {"method": "search_lm", "views": int(views)}
        row |= {"occlusion": occlusion, "count": 20, "judged": 20, "median_position_error": median}
        rows.append(row | {"median_seconds": 1.0, "worst_seconds": 6.0})
    return pd.DataFrame(rows, columns=list(tables.SUMMARY_COLUMNS))


def test_each_goal_is_met_or_missed_by_its_own_figure():
    summary = _summary(visible_1=0.009, occluded_1=0.04, all_1=0.02, all_3=0.01)
    found = goals.goals(summary, {"test_psnr_mean": 34.9, "seconds": 100.0}, "search_lm")
    assert [goal.met for goal in found] == [False, True, True, False, True, False]


def test_what_was_not_measured_is_neither_met_nor_missed():
    found = goals.goals(_summary(), None, "search_lm")
    assert [goal.met for goal in found] == [None] * 6
    assert {goal.found for goal in found} == {"not measured"}


def test_a_median_over_few_targets_does_not_meet_the_goal():
    summary = _summary(visible_1=0.001)
    summary["judged"] = 19
    assert goals.goals(summary, None, "search_lm")[2].met is False


def test_the_preferred_method_is_taken_if_it_was_run():
    assert goals.primary_method(_summary(all_1=0.1)) == "search_lm"
    assert goals.primary_method(_summary(all_1=0.1).assign(method="paper_adam")) == "paper_adam"
    assert goals.primary_method(_summary()) == "search_lm"
