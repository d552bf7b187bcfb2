"""Figures of the benchmarks: error against time, and cost against the number of surfels."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rgspipe.benchmark.front import mark_front
from rgspipe.evaluation.plots import STYLE

OURS, FRONT, PEER = "#8a9099", "#0072B2", "#D55E00"

#: A point of the front is labelled if its error is below this part of the last labelled one's.
LABEL_STEP = 0.93

ABBREVIATIONS = (
    ("gather_rays=", "M "),
    ("shadows=pixels", "at pixels"),
    ("surfels=", "N "),
    ("patches=", "P "),
    ("supersampling=", "s "),
)


def front_figure(settings: pd.DataFrame, peers: pd.DataFrame, *, error: str) -> Figure:
    """Error against the time of an image and its gradient, and against the time from nothing to the first image.

    Args:
        settings: rows with `setting`, `step_ms`, `first_ms` and the column `error`.
        peers: rows of other renderers with `renderer`, `spp`, `step_ms`, `first_ms` and `error`; may be empty.
    """
    panels = {
        "step_ms": ("What accuracy costs, per step", "image and gradient, once built (ms)"),
        "first_ms": ("… and with everything that comes before", "from surfels to the first image, all built (ms)"),
    }
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 5.0), layout="constrained")
        for axis, (column, (title, label)) in zip(figure.subplots(1, 2, sharey=True), panels.items(), strict=True):
            _front(axis, mark_front(settings, time=column, error=error), column, error)
            known = peers[peers[column].notna()] if column in peers else peers.iloc[:0]
            for name, group in known.groupby("renderer"):
                axis.plot(group[column], 100 * group[error], "s--", color=PEER, ms=5, label=str(name))
                for row in group.itertuples():
                    _label(axis, f"{row.spp:.0f} spp", getattr(row, column), 100 * getattr(row, error), PEER)
            axis.set(xscale="log", yscale="log", xlabel=label, title=title)
            axis.grid(visible=True, which="both")
        figure.axes[0].set_ylabel("relative error of global images (%)")
        figure.axes[0].legend(loc="lower left", fontsize=7.5)
    return figure


def _front(axis: Axes, marked: pd.DataFrame, column: str, error: str) -> None:
    axis.scatter(marked[column], 100 * marked[error], s=16, color=OURS, label="rgspipe, every setting")
    front = marked[marked["on_front"]]
    axis.plot(front[column], 100 * front[error], "o-", color=FRONT, ms=5, label="rgspipe, the front")
    above = np.inf
    for row in front.itertuples():
        height = 100 * getattr(row, error)
        # Points that all but touch share the label of the first.
        if height < LABEL_STEP * above:
            _label(axis, _short(row.setting), getattr(row, column), height, FRONT)
            above = height


def _label(axis: Axes, text: str, x: float, y: float, colour: str) -> None:
    axis.annotate(text, (x, y), fontsize=6.5, xytext=(5, 3), textcoords="offset points", color=colour)


def scaling_figure(scaling: pd.DataFrame) -> Figure:
    """Time of each part and memory against the number of surfels, both axes logarithmic."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2)
        for part, group in scaling.groupby("part", sort=False):
            left.plot(group["surfels"], group["ms"], "o-", ms=4, label=str(part))
        first = scaling.groupby("part", sort=False).first()
        reach = scaling["surfels"].agg(["min", "max"]).to_numpy(float)
        for row in first.itertuples():
            left.plot(reach, row.ms * reach / row.surfels, ":", color="#c9cdd2", zorder=0)
        memory = scaling.drop_duplicates("surfels")
        right.plot(memory["surfels"], memory["operators_mib"], "o-", ms=4, label="operators")
        right.plot(memory["surfels"], memory["peak_mib"], "s-", ms=4, label="peak of the process while building")
        for axis, label in ((left, "ms"), (right, "MiB")):
            axis.set(xscale="log", yscale="log", xlabel="surfels", ylabel=label)
            axis.grid(visible=True)
            axis.legend(fontsize=7.5)
        left.set_title("Time (dotted: linear)")
        right.set_title("Memory")
    return figure


def _short(setting: str) -> str:
    """A setting's name, small enough for a label."""
    for long, brief in ABBREVIATIONS:
        setting = setting.replace(long, brief)
    return setting
