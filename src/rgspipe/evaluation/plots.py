"""Figures of the report. Matplotlib's object interface only: nothing here depends on global state."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence

import matplotlib
import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rgspipe.evaluation import metrics
from rgspipe.evaluation.classes import class_order

#: Colours that stay apart with colour blindness and in grey, and from white by 3 and more; markers say the same again.
COLOURS = {"visible": "#0072B2", "out_of_frame": "#C58700", "occluded": "#6A1B4D", "around_corner": "#0AA37C"}
MARKERS = {"visible": "o", "out_of_frame": "s", "occluded": "^", "around_corner": "v"}
LABELS = {
    "visible": "visible",
    "out_of_frame": "out of frame",
    "occluded": "occluded",
    "around_corner": "around the corner",
    "mixed": "mixed",
    "unknown": "unclassified",
}
#: How courses of a class are dashed.
DASHES: dict[str, str | tuple] = {
    "visible": "-",
    "out_of_frame": (0, (5, 1.5)),
    "occluded": (0, (1.5, 1)),
    "around_corner": (0, (5, 1.2, 1.2, 1.2)),
}
OTHER_COLOUR, OTHER_MARKER, OTHER_DASHES = "#666666", "D", "--"

INK, FAINT = "#222222", "#c9cdd2"
#: Position errors outside this range are drawn at its ends.
ERROR_RANGE = (1e-4, 2.0)
#: At most this many surfels are drawn as dots.
CLOUD_POINTS = 6000
#: At most this many points of one fit's course are drawn.
CURVE_POINTS = 200

#: Matplotlib settings of every figure.
STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": "#8a9099",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": "#555b63",
    "ytick.color": "#555b63",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e6e8eb",
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "rgspipe",
}


def colour_of(name: str) -> str:
    """The colour of an occlusion class."""
    return COLOURS.get(name, OTHER_COLOUR)


def thinned(points: npt.NDArray) -> npt.NDArray:
    """At most CLOUD_POINTS of the rows, the same ones every time."""
    if len(points) <= CLOUD_POINTS:
        return points
    return points[np.random.default_rng(0).permutation(len(points))[:CLOUD_POINTS]]


def svg_bytes(figure: Figure) -> bytes:
    """The figure as an SVG file without a date: equal figures give equal bytes."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def png_of(figure: Figure, dpi: int = 150) -> bytes:
    """The figure as a PNG file."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.set_dpi(dpi)
        FigureCanvasAgg(figure).print_png(buffer)
    return buffer.getvalue()


def convergence_figure(curves: pd.DataFrame) -> Figure:
    """Loss (relative to its first value) and position error against the step, both on log scales.

    Args:
        curves: rows of `convergence_table`, of any number of fits, methods and view counts.

    One column per method and view count; a thin line a target, a thick one for the class's median, in
    which a fit that has stopped stays where it is.
    """
    groups = list(curves.groupby(["method", "views"], sort=False))
    if not groups:
        raise ValueError("no convergence to draw")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(max(4.6, min(11.0, 2.9 * len(groups))), 5.0), layout="constrained")
        axes = figure.subplots(2, len(groups), squeeze=False, sharex="col", sharey="row")
        for column, ((method, views), group) in enumerate(groups):
            axes[0, column].set_title(f"{method}, {_views(views)}")
            _curves(axes[0, column], group, "loss", relative=True)
            if _curves(axes[1, column], group, "position_error", relative=False):
                _limit_line(axes[1, column])
            axes[1, column].set_xlabel("step")
        axes[0, 0].set_ylabel("loss / loss at the start")
        axes[1, 0].set_ylabel("position error (fraction of scene)")
        class_legend(figure, curves["occlusion"])
    return figure


def error_figure(targets: pd.DataFrame) -> Figure:
    """Position and intensity errors of every target per class and view count, with boxes; log scale.

    Args:
        targets: rows of `target_table` of any number of methods and view counts, some with known truth.
    """
    known = targets[targets["position_error"].notna()]
    if known.empty:
        raise ValueError("no target has a known truth")
    methods = list(dict.fromkeys(known["method"]))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(max(5.0, min(11.0, 5.2 * len(methods))), 5.6), layout="constrained")
        axes = figure.subplots(2, len(methods), squeeze=False, sharey="row")
        for column, method in enumerate(methods):
            group = known[known["method"] == method]
            axes[0, column].set_title(str(method))
            for row, name in enumerate(("position_error", "intensity_error")):
                _strips(axes[row, column], group, name)
            _limit_line(axes[0, column])
        axes[0, 0].set_ylabel("position error (fraction of scene)")
        axes[1, 0].set_ylabel("relative intensity error")
    return figure


def training_figure(training: pd.DataFrame) -> Figure:
    """Loss and training PSNR against the seconds of training (the row, if seconds are not known).

    Args:
        training: rows with `loss` and where known `psnr`, `seconds`, `kind`; kinds get markers.
    """
    if "loss" not in training.columns or training.empty:
        raise ValueError(f"training needs rows with a loss, found columns {list(training.columns)}")
    timed = "seconds" in training.columns and training["seconds"].notna().all()
    x = (training["seconds"] if timed else pd.Series(np.arange(len(training)))).to_numpy(dtype=float)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 3.0), layout="constrained")
        left, right = figure.subplots(1, 2)
        for axis, name, label in ((left, "loss", "training loss"), (right, "psnr", "PSNR (dB)")):
            _training_curve(axis, training, name, x)
            axis.set_ylabel(label)
            axis.set_xlabel("training time (s)" if timed else "row of the log")
        positive = training["loss"].dropna()
        if len(positive) and (positive > 0).all():
            left.set_yscale("log")
        if "kind" in training.columns:
            left.legend(fontsize=8)
    return figure


def _training_curve(axis: Axes, training: pd.DataFrame, name: str, x: npt.NDArray) -> None:
    axis.grid(True)
    values = training[name].to_numpy(dtype=float) if name in training.columns else np.full(len(training), math.nan)
    known = np.isfinite(values)
    if not known.any():
        axis.text(0.5, 0.5, "not recorded", transform=axis.transAxes, ha="center", va="center", color="#777777")
        return
    axis.plot(x[known], values[known], color=FAINT, lw=1.0, zorder=1)
    kinds = training["kind"].astype(str).to_numpy() if "kind" in training.columns else np.full(len(training), "")
    palette = ("#0072B2", "#E69F00", "#6A1B4D", "#009E73", "#56B4E9")
    for index, kind in enumerate(dict.fromkeys(kinds.tolist())):
        rows = known & (kinds == kind)
        axis.plot(x[rows], values[rows], "o", ms=3, color=palette[index % len(palette)], label=kind)


def _views(count: int) -> str:
    return "1 view" if int(count) == 1 else f"{int(count)} views"


def _limit_line(axis: Axes) -> None:
    axis.axhline(metrics.SUCCESS_LIMIT, color="#555b63", lw=0.9, ls=(0, (4, 3)), zorder=1)


def _clipped(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    return np.clip(np.asarray(values, dtype=float), *ERROR_RANGE)


def _curves(axis: Axes, group: pd.DataFrame, name: str, relative: bool) -> bool:
    """Draw the courses of one measure; returns whether there was any."""
    axis.grid(True)
    axis.set_yscale("log")
    drawn = False
    for occlusion in class_order(group["occlusion"]):
        lines = []
        for _, curve in group[group["occlusion"] == occlusion].groupby("target"):
            values = curve[name].to_numpy(dtype=float)
            if relative:
                values = values / values[0] if values[0] > 0.0 else np.full(len(values), math.nan)
            known = np.isfinite(values)
            if not known.any():
                continue
            values = np.maximum(values[known], 1e-12) if relative else _clipped(values[known])
            steps = curve["step"].to_numpy(dtype=float)[known]
            kept = np.unique(np.linspace(0, len(steps) - 1, min(len(steps), CURVE_POINTS)).astype(int))
            steps, values = steps[kept], values[kept]
            axis.plot(steps, values, color=colour_of(occlusion), lw=0.6, alpha=0.3)
            lines.append((steps, values))
        if lines:
            drawn = True
            steps, middle = _median_curve(lines)
            axis.plot(steps, middle, ls=DASHES.get(occlusion, OTHER_DASHES), color=colour_of(occlusion), lw=2.0)
    if not drawn:
        axis.text(
            0.5, 0.5, "truth unknown" if not relative else "no positive loss", transform=axis.transAxes, ha="center"
        )


def _median_curve(lines: list[tuple[npt.NDArray, npt.NDArray]]) -> tuple[npt.NDArray, npt.NDArray]:
    """The median over curves (steps, values) at every step that occurs; a curve keeps its last value."""
    steps = np.unique(np.concatenate([line[0] for line in lines]))
    held = [np.interp(steps, *line) for line in lines]
    return steps, np.median(held, axis=0)


def _strips(axis: Axes, group: pd.DataFrame, name: str) -> None:
    """Points and boxes, classes along x and view counts beside each other within a class."""
    axis.grid(True, axis="y")
    axis.set_yscale("log")
    classes, views = class_order(group["occlusion"]), sorted(group["views"].unique())
    jitter = np.random.default_rng(0)
    ticks: list[float] = []
    for place, occlusion in enumerate(classes):
        for index, count in enumerate(views):
            rows = group[(group["occlusion"] == occlusion) & (group["views"] == count)]
            values = _clipped(rows[name].dropna())
            x = place * (len(views) + 0.8) + index
            ticks.append(x)
            if values.size:
                _box(axis, x, values, colour_of(occlusion))
                spread = x + jitter.uniform(-0.22, 0.22, values.size)
                marker = MARKERS.get(occlusion, OTHER_MARKER)
                axis.plot(spread, values, marker, ms=3.5, alpha=0.75, color=colour_of(occlusion), mew=0)
    axis.set_xticks(ticks, [_views(count) for _ in classes for count in views], minor=True, fontsize=8)
    middles = [float(np.mean(ticks[start : start + len(views)])) for start in range(0, len(ticks), len(views))]
    axis.set_xticks(middles, [LABELS.get(name, name) for name in classes], fontsize=9)
    axis.tick_params(axis="x", which="major", length=0, pad=17, labelsize=9)
    axis.tick_params(axis="x", which="minor", labelsize=8)
    axis.set_xlim(ticks[0] - 0.7, ticks[-1] + 0.7)


def _box(axis: Axes, x: float, values: npt.NDArray, colour: str) -> None:
    line = {"color": colour, "linewidth": 1.0}
    axis.boxplot(
        values,
        positions=[x],
        widths=0.62,
        showfliers=False,
        patch_artist=True,
        manage_ticks=False,
        boxprops={"facecolor": colour, "alpha": 0.16, "edgecolor": colour},
        medianprops={"color": colour, "linewidth": 2.2},
        whiskerprops=line,
        capprops=line,
    )


def class_legend(figure: Figure, names: pd.Series, extra: Sequence[Line2D] = ()) -> None:
    """Below the figure: the colours, dashes and marks of occlusion classes, and what is given besides."""
    handles = []
    for name in class_order(names):
        look = {"ls": DASHES.get(name, OTHER_DASHES), "marker": MARKERS.get(name, OTHER_MARKER), "mfc": "none"}
        handles.append(Line2D([], [], color=colour_of(name), lw=1.6, ms=6.0, label=LABELS.get(name, name), **look))
    handles += extra
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8.5, handlelength=3.2)
