"""Figures of the benchmarks: error against time, and cost against the number of surfels."""

from __future__ import annotations

import matplotlib
import pandas as pd
from matplotlib.figure import Figure

from rgspipe.evaluation.plots import STYLE

OURS, FRONT, PEER = "#8a9099", "#0072B2", "#D55E00"


def front_figure(settings: pd.DataFrame, peers: pd.DataFrame, *, error: str) -> Figure:
    """Error against the time of an image and its gradient, and against the time from nothing to the first image.

    Args:
        settings: rows of `mark_front` with `step_ms`, `build_s`, `on_front` and the column `error`.
        peers: rows of other renderers with `renderer`, `spp`, `forward_ms`, `step_ms` and `error`; may be empty.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.6), layout="constrained")
        for axis, column, label in zip(
            figure.subplots(1, 2, sharey=True),
            ("step_ms", "first_ms"),
            ("image and gradient, once built (ms)", "from surfels to the first image, all built (ms)"),
            strict=True,
        ):
            front = settings[settings["on_front"]]
            axis.scatter(settings[column], 100 * settings[error], s=16, color=OURS, label="rgspipe, every setting")
            ordered = front.sort_values(column)
            axis.plot(ordered[column], 100 * ordered[error], "o-", color=FRONT, ms=5, label="rgspipe, the front")
            for row in front.itertuples():
                axis.annotate(
                    _short(row.setting), (getattr(row, column), 100 * getattr(row, error)), fontsize=6.5,
                    xytext=(4, 4), textcoords="offset points", color=FRONT,
                )  # fmt: skip
            known = peers[peers[column].notna()] if column in peers else peers.iloc[:0]
            for name, group in known.groupby("renderer"):
                axis.plot(group[column], 100 * group[error], "s--", color=PEER, ms=5, label=str(name))
                for row in group.itertuples():
                    axis.annotate(
                        f"{row.spp:.0f} spp", (getattr(row, column), 100 * getattr(row, error)), fontsize=6.5,
                        xytext=(4, 4), textcoords="offset points", color=PEER,
                    )  # fmt: skip
            axis.set(xscale="log", yscale="log", xlabel=label)
            axis.grid(visible=True, which="both")
        axes = figure.axes
        axes[0].set_ylabel("relative error of global images (%)")
        axes[0].set_title("What accuracy costs, per step")
        axes[1].set_title("… and with everything that comes before")
        axes[0].legend(loc="best", fontsize=7.5)
    return figure


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
    for long, brief in (("surfels=", "N "), ("gather_rays=", "M "), ("patches=", "P "), ("supersampling=", "ss ")):
        setting = setting.replace(long, brief)
    return setting
