"""Figures of the studies: drawn from the table, one panel for what was measured, intervals where they are."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from rgspipe.evaluation.plots import png_of
from rgspipe.studies.light_figure import light_figure
from rgspipe.studies.lights import KINDS


def _row(**named: object) -> dict:
    row = {"scene": "cornell", "case": "clean", "method": "search_lm", "views": 1, "occlusion": "all"} | named
    for name, value in (("position", 0.004), ("intensity", 0.01), ("success", 0.9), ("seconds", 0.8)):
        row |= {name: value, f"{name}_low": 0.5 * value, f"{name}_high": 1.1 * value}
    row |= {"inside_95": 0.95, "inside_95_low": 0.8, "inside_95_high": 1.0, "stated": 0.005}
    row |= {"silent": 0.02, "silent_low": 0.0, "silent_high": 0.1}
    return row | named


def _table(**lists: list) -> pd.DataFrame:
    rows = [{}]
    for name, values in lists.items():
        rows = [row | {name: value} for row in rows for value in values]
    return pd.DataFrame([_row(**row) for row in rows])


def test_errors_are_drawn_over_views_with_what_was_stated_and_foretold() -> None:
    table = _table(occlusion=["visible", "occluded", "all"], views=[1, 2, 4]).assign(predicted=0.006)
    figure = light_figure(table, "views")
    assert [axis.get_title(loc="left") for axis in figure.axes[:3]] == ["visible", "occluded", "all classes"]
    first = figure.axes[0]
    assert [list(line.get_xdata()) for line in first.lines[:3]] == [[1, 2, 4]] * 3
    assert [line.get_ydata()[0] for line in first.lines[:3]] == pytest.approx([0.4, 0.5, 0.6])
    assert first.get_yscale() == "log" and figure.axes[3].get_ylim() == (-4.0, 104.0)
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert words == ["search_lm", "error that fits state", "predicted by fits of 1 view"]
    assert len(png_of(figure)) > 5000


def test_a_single_class_is_not_drawn_twice() -> None:
    figure = light_figure(_table(occlusion=["around_corner", "all"], views=[1, 3]), "views")
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["around the corner", "", ""]


@pytest.mark.parametrize("classes", [["around_corner", "all"], ["visible", "occluded", "all"]])
def test_the_key_of_a_figure_over_views_has_room(classes: list[str]) -> None:
    """A lone column of panels would cut off half of it."""
    table = _table(occlusion=classes, views=[1, 3], method=["search_lm", "paper_adam"]).assign(predicted=0.006)
    figure = light_figure(table, "views")
    png_of(figure)
    key = figure.legends[0].get_window_extent()
    assert len(figure.legends[0].get_texts()) == 4 and key.x0 >= 0 and key.x1 <= figure.bbox.width
    assert [axis.get_xlabel() for axis in figure.axes[-len(classes) :]] == ["views"] * len(classes)


def test_without_predictions_none_are_drawn() -> None:
    figure = light_figure(_table(views=[1, 2], method=["search_lm", "paper_adam"]), "views")
    # Of each method what was measured and what fits state, and the limit of a success.
    assert len(figure.axes[0].lines) == 5
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["search_lm", "paper_adam", "error that fits state"]


def test_cases_are_rows_and_scenes_series() -> None:
    table = _table(scene=["cornell", "corner"], case=["clean", "noise 3 %"], occlusion=["visible", "all"])
    figure = light_figure(table, "robustness")
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["clean", "noise 3 %"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["cornell", "corner"]
    assert [axis.get_title(loc="left") for axis in figure.axes][-1] == "silently wrong (%)"
    points = [line for line in figure.axes[0].lines if line.get_marker() in ("o", "s")]
    assert [line.get_ydata()[0] for line in points] == pytest.approx([-0.11, 0.89, 0.11, 1.11])


def test_classes_of_scenes_are_rows_and_surfels_series() -> None:
    table = _table(scene=["cornell", "corner"], case=["trained", "true"], views=[1, 3], occlusion=["visible", "all"])
    figure = light_figure(table, "classes")
    rows = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert rows == ["cornell: visible", "corner: visible"]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["trained, 1 view", "trained, 3 views", "true, 1 view", "true, 3 views"]


@pytest.mark.parametrize("kind", KINDS)
def test_failed_fits_are_drawn_at_the_end_of_the_range(kind: str) -> None:
    table = _table(views=[1, 2], occlusion=["visible", "all"])
    table.loc[0, ["position_high", "intensity", "intensity_high"]] = math.inf
    assert len(png_of(light_figure(table, kind))) > 5000


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ValueError, match="known truth"):
        light_figure(_table(views=[1]).assign(position=math.nan), "views")
