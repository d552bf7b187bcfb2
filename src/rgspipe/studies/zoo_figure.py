"""Success and error in rooms that nobody tuned, against what no camera saw and against the number of views."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from rgspipe.evaluation import metrics
from rgspipe.evaluation.plots import ERROR_RANGE, INK, STYLE
from rgspipe.studies.light_figure import COLOURS, MARKERS
from rgspipe.studies.lights import wilson_interval
from rgspipe.studies.zoo import RANGES
from rgspipe.studies.zoo_rooms import FINAL, WORK

#: Column, label of the axis and factor of each pair of panels.
AXES = (
    ("unseen", "area that no camera saw (%)", 100.0),
    ("guessed", "guessed, of what surfaces look at (%)", 100.0),
    ("train_views", "training views", 1.0),
)

#: Lines and fillings of the two kinds of seeds.
LINES = {WORK: (0, (3.0, 2.0)), FINAL: "-"}
SEEDS = {WORK: "odd seeds (work)", FINAL: "even seeds (final)"}


def zoo_figure(table: pd.DataFrame) -> Figure:
    """Success with its 95 % interval in ranges of each property above, the error of each fit below.

    Args:
        table: see `zoo.fits_table`; of one or more cases.

    Raises:
        ValueError: the table is empty.
    """
    if table.empty:
        raise ValueError("the study has no rows")
    series = list(table.groupby(["case", "method", "views"], sort=False))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(13.0, 6.6), layout="constrained")
        axes = figure.subplots(2, len(AXES), sharex="col", sharey="row")
        for column, (name, label, factor) in enumerate(AXES):
            for index, (_, rows) in enumerate(series):
                for part, fits in rows.groupby("part"):
                    style = {"color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)]}
                    style["mfc"] = style["color"] if part == FINAL else "white"
                    _success(axes[0, column], fits, name, factor, style | {"ls": LINES[str(part)]}, index)
                    _errors(axes[1, column], fits, name, factor, style)
            axes[1, column].set_xlabel(label)
            most = factor * float(np.nanmax([0.0, *table[name].astype(float)]))
            axes[1, column].set_xlim(0.0, 1.08 * most + 1.0)
        _dress(axes)
        figure.legend(handles=_handles(table, series), loc="outside upper center", ncols=6)
    return figure


def _success(axis: Axes, fits: pd.DataFrame, name: str, factor: float, style: dict, index: int) -> None:
    """A point in the middle of the fits of each range, moved a little so that series do not hide each other."""
    values, solved = fits[name].to_numpy(dtype=float), fits["success"].astype("boolean")
    known = np.isfinite(values) & solved.notna().to_numpy()
    points = []
    for which in np.unique(np.digitize(values[known], RANGES[name])):
        chosen = known & (np.digitize(values, RANGES[name]) == which)
        verdicts = solved[chosen].astype(bool)
        low, high = wilson_interval(int(verdicts.sum()), len(verdicts))
        points.append((factor * float(np.mean(values[chosen])), 100.0 * float(verdicts.mean()), 100 * low, 100 * high))
    if points:
        x, middle, low, high = np.array(points).T
        x = x + 0.4 * index
        axis.plot(x, middle, ms=6, lw=1.4, **style)
        axis.vlines(x, low, high, color=style["color"], lw=1.2, alpha=0.6)


def _errors(axis: Axes, fits: pd.DataFrame, name: str, factor: float, style: dict) -> None:
    errors = fits["position_error"].to_numpy(dtype=float)
    known = ~np.isnan(errors)
    drawn = 100.0 * np.clip(errors[known], *ERROR_RANGE)
    axis.plot(factor * fits[name].to_numpy(dtype=float)[known], drawn, ls="none", ms=5, alpha=0.8, **style)


def _dress(axes: np.ndarray) -> None:
    axes[0, 0].set(ylabel="solved (%)", ylim=(-4.0, 104.0))
    axes[1, 0].set(ylabel="position error (%)", yscale="log")
    axes[1, 0].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    for axis in axes.flat:
        axis.grid(True)
    for axis in axes[1]:
        axis.axhline(100.0 * metrics.SUCCESS_LIMIT, color=INK, lw=0.8, ls="-.", zorder=1)


def _handles(table: pd.DataFrame, series: list) -> list[Line2D]:
    cases, methods = table["case"].nunique(), table["method"].nunique()
    handles = []
    for index, ((case, method, views), _) in enumerate(series):
        words = [str(case)] * (cases > 1) + [str(method)] * (methods > 1)
        words.append(f"{views} view{'s' if views > 1 else ''}")
        style = {"color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)]}
        handles.append(Line2D([], [], ls="none", ms=6, label=", ".join(words), **style))
    for part in sorted(set(table["part"]), reverse=True):
        filled = INK if part == FINAL else "white"
        handles.append(Line2D([], [], color=INK, ls=LINES[part], marker="o", mfc=filled, ms=6, label=SEEDS[part]))
    return handles
