"""Figures of the studies of recovered lights, each drawn from the table of its study."""

from __future__ import annotations

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from rgspipe.evaluation import metrics
from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.plots import INK, LABELS, STYLE
from rgspipe.studies.light_table import TOGETHER
from rgspipe.studies.lights import several, without_repeats

#: Column, title, factor, whether logarithmic.
Panel = tuple[str, str, float, bool]

COLOURS = ("#0072B2", "#E69F00", "#6A1B4D", "#009E73", "#56B4E9", "#222222")
MARKERS = "os^Dv*"
#: Lines of what fits state of themselves, and of what one view foretells.
STATED_LINE, PREDICTED_LINE = (0, (5.0, 2.0)), (0, (1.0, 1.5))
#: Errors outside this range, in per cent, are drawn at its ends.
PERCENT_RANGE = (0.01, 200.0)
#: How far apart the series of a row stand, in rows.
SERIES_STEP = 0.22

#: Panels of a comparison of rows. The last is of robustness alone.
PANELS: tuple[Panel, ...] = (
    ("position", "position error (%)", 100.0, True),
    ("intensity", "intensity error (%)", 100.0, True),
    ("success", "solved (%)", 100.0, False),
    ("inside_95", "truth in 95 % region (%)", 100.0, False),
    ("silent", "silently wrong (%)", 100.0, False),
)
#: Rows of the figure over numbers of views: column, label, factor.
VIEW_PANELS = (("position", "position error (%)", 100.0), ("success", "solved (%)", 100.0), ("seconds", "s a fit", 1.0))


def light_figure(table: pd.DataFrame, kind: str) -> Figure:
    """The figure of a study.

    Args:
        table: its rows, see `lights.case_rows`.
        kind: one of `lights.KINDS`.

    Raises:
        ValueError: there is nothing to draw.
    """
    if table.empty or not np.isfinite(table["position"].to_numpy(dtype=float)).any():
        raise ValueError("no target of the study has a known truth and a light that was found")
    if kind == "views":
        return views_figure(table)
    if kind in TOGETHER:
        series = ["scene", "method", "views"] if kind == "robustness" else ["scene", "method"]
        return rows_figure(table[table["occlusion"] == ALL], ["case"], series, PANELS, kind == "robustness")
    rows = table[table["occlusion"] != ALL]
    return rows_figure(rows, ["scene", "occlusion"], ["case", "method", "views"], PANELS[:-1])


def views_figure(table: pd.DataFrame) -> Figure:
    """Error, success rate and time against the number of views: a column a class, bands are 95 % intervals.

    Beside the measured median error stand the median of what fits state of themselves (dashed) and, where the table
    has it, what the fits with the fewest views foretell (dotted). A single class has its panels side by side, as a
    lone column is too narrow for the key above it.
    """
    table = without_repeats(table)
    columns = [
        (scene, name) for scene, part in table.groupby("scene", sort=False) for name in _classes(part["occlusion"])
    ]
    series = several(table, ["case", "method"]) or ["method"]
    many_methods = table["method"].nunique() > 1
    order = list(dict.fromkeys(table[series].itertuples(index=False, name=None)))
    with matplotlib.rc_context(STYLE):
        figure, axes = _view_axes(len(columns))
        _logarithmic(axes[0, 0].yaxis, axes[0, :], "y")
        if many_methods:
            _logarithmic(axes[2, 0].yaxis, axes[2, :], "y")
        for row, (_, label, _) in enumerate(VIEW_PANELS):
            axes[row, 0].set_ylabel(label)
        for column, (scene, name) in enumerate(columns):
            part = table[(table["scene"] == scene) & (table["occlusion"] == name)]
            axes[0, column].set_title(_title(scene, name, table))
            for row, (measure, _, factor) in enumerate(VIEW_PANELS):
                _view_lines(axes[row, column], part, series, order, measure, factor)
        for axis in axes.flat:
            axis.xaxis.set_major_locator(MaxNLocator(integer=True))
            if axis.get_subplotspec().is_last_row():
                axis.set_xlabel("views")
        axes[1, 0].set_ylim(-4.0, 104.0)
        if not many_methods:
            axes[2, 0].set_ylim(bottom=0.0)
        figure.legend(handles=_view_handles(table, series), loc="outside upper center", ncols=4)
    return figure


def _view_axes(columns: int) -> tuple[Figure, np.ndarray]:
    """A figure and its axes by measure and class."""
    if columns == 1:
        figure = Figure(figsize=(9.0, 3.2), layout="constrained")
        return figure, figure.subplots(1, len(VIEW_PANELS), squeeze=False, sharex=True).T
    figure = Figure(figsize=(1.2 + 2.3 * columns, 6.4), layout="constrained")
    return figure, figure.subplots(len(VIEW_PANELS), columns, squeeze=False, sharex=True, sharey="row")


def rows_figure(
    table: pd.DataFrame, rows: Sequence[str], series: Sequence[str], shown: Sequence[Panel], reference: bool = False
) -> Figure:
    """Measures with their 95 % intervals, a panel each: `rows` name the rows, `series` colours and markers.

    With `reference` a line through each panel says where the series stands in the first row.
    """
    places = list(dict.fromkeys(table[list(rows)].itertuples(index=False, name=None)))
    groups = list(table.groupby(list(several(table, series) or series[:1]), sort=False))
    panels = [panel for panel in shown if table[panel[0]].notna().any()]
    with matplotlib.rc_context(STYLE):
        height = 1.3 + len(places) * max(0.3, SERIES_STEP * len(groups) * 0.8)
        figure = Figure(figsize=(2.6 + 2.1 * len(panels), height), layout="constrained")
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axis, panel in zip(axes, panels, strict=True):
            _panel(axis, panel)
            for index, (_, group) in enumerate(groups):
                shift = SERIES_STEP * (index - 0.5 * (len(groups) - 1))
                known = {tuple(row[name] for name in rows): row for row in group.to_dict("records")}
                _row_points(axis, [known.get(place) for place in places], panel, shift, index, reference)
        axes[0].set_yticks(range(len(places)), [_row_title(rows, place, table) for place in places])
        axes[0].set_ylim(len(places) - 0.5, -0.5)
        if len(groups) > 1:
            labels = [_series_title(series, table, group) for _, group in groups]
            handles = [_handle(index, label) for index, label in enumerate(labels)]
            figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def _view_lines(
    axis: Axes, part: pd.DataFrame, series: Sequence[str], order: Sequence[tuple], measure: str, factor: float
) -> None:
    axis.grid(True)
    for index, name in enumerate(order):
        group = part[(part[list(series)] == name).all(axis=1)].sort_values("views")
        views, colour = group["views"].to_numpy(), COLOURS[index % len(COLOURS)]
        low, middle, high = (_drawn(group[measure + end], factor) for end in ("_low", "", "_high"))
        axis.fill_between(views, low, high, color=colour, alpha=0.15, lw=0)
        axis.plot(views, middle, MARKERS[index % len(MARKERS)] + "-", color=colour, ms=4, lw=1.5)
        if measure == "position":
            for name, style in (("stated", STATED_LINE), ("predicted", PREDICTED_LINE)):
                if name in group.columns:
                    axis.plot(views, _drawn(group[name], factor), ls=style, color=colour, lw=1.2)
    if measure == "position":
        axis.axhline(100.0 * metrics.SUCCESS_LIMIT, color="#555b63", lw=0.8, ls="-.", zorder=1)


def _drawn(values: pd.Series, factor: float) -> np.ndarray:
    """Values as they are drawn: what is infinite stands at the end of the range."""
    found = factor * values.to_numpy(dtype=float)
    return np.where(np.isinf(found), PERCENT_RANGE[1], found)


def _row_points(
    axis: Axes, rows: Sequence[dict | None], panel: Panel, shift: float, index: int, reference: bool
) -> None:
    """The points of one series; a row that it lacks stays empty."""
    column, _, factor, logarithmic = panel
    colour, marker = COLOURS[index % len(COLOURS)], MARKERS[index % len(MARKERS)]
    for place, row in enumerate(rows):
        if row is None or math.isnan(row[column]):
            continue
        values = np.array([row[column + end] for end in ("_low", "", "_high")])
        low, middle, high = np.clip(factor * values, *PERCENT_RANGE) if logarithmic else factor * values
        axis.plot([low, high], [place + shift] * 2, "-", color=colour, lw=1.3, alpha=0.6)
        axis.plot([middle], [place + shift], marker, color=colour, ms=5)
        if reference and place == 0:
            axis.axvline(middle, color=colour, lw=0.8, alpha=0.5, zorder=0)


def _panel(axis: Axes, panel: Panel) -> None:
    _, title, _, logarithmic = panel
    axis.set_title(title)
    axis.grid(True, axis="x")
    if logarithmic:
        _logarithmic(axis.xaxis, [axis], "x")
    else:
        axis.set_xlim(-4.0, 104.0)


def _logarithmic(ticks: object, axes: Sequence[Axes], which: str) -> None:
    for axis in axes:
        axis.set(**{f"{which}scale": "log"})
    ticks.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ticks.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ticks.set_minor_formatter(NullFormatter())


def _view_handles(table: pd.DataFrame, series: Sequence[str]) -> list[Line2D]:
    groups = list(table.groupby(list(series), sort=False))
    handles = [_handle(index, _series_title(series, table, group), "-") for index, (_, group) in enumerate(groups)]
    handles.append(Line2D([], [], color=INK, lw=1.2, ls=STATED_LINE, label="error that fits state"))
    if "predicted" in table.columns and table["predicted"].notna().any():
        fewest = int(table["views"].min())
        words = f"predicted by fits of {fewest} view{'s' if fewest > 1 else ''}"
        handles.append(Line2D([], [], color=INK, lw=1.2, ls=PREDICTED_LINE, label=words))
    return handles


def _handle(index: int, label: str, line: str = "none") -> Line2D:
    colour, marker = COLOURS[index % len(COLOURS)], MARKERS[index % len(MARKERS)]
    return Line2D([], [], color=colour, marker=marker, ms=5, ls=line, label=label)


def _classes(names: pd.Series) -> list[str]:
    return [*class_order([name for name in names if name != ALL]), *names[names == ALL].unique()]


def _title(scene: str, name: str, table: pd.DataFrame) -> str:
    words = "all classes" if name == ALL else LABELS.get(name, name)
    return f"{scene}: {words}" if table["scene"].nunique() > 1 else words


def _row_title(rows: Sequence[str], place: tuple, table: pd.DataFrame) -> str:
    named = dict(zip(rows, place, strict=True))
    if "occlusion" in named:
        return _title(str(named["scene"]), str(named["occlusion"]), table)
    return str(named["case"])


def _series_title(series: Sequence[str], table: pd.DataFrame, group: pd.DataFrame) -> str:
    """What tells a series from the others."""
    words = []
    for name in several(table, series) or series[:1]:
        value = group[name].iloc[0]
        words.append(f"{value} view{'s' if value != 1 else ''}" if name == "views" else str(value))
    return ", ".join(words)
