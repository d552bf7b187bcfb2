"""Figures of trained scenes: where their error sits, and what bad captures cost."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.held_out import SURFELS
from rgspipe.evaluation.plots import INK, STYLE
from rgspipe.evaluation.study import TRUTH
from rgspipe.evaluation.study_cases import CLEAN

#: Kinds of pixels in words, and their colours.
KIND_LABELS = {
    "edges": "silhouettes and creases",
    "shadow_edges": "edges of shadows",
    "near_light": "near the light",
    "rest": "the rest",
}
KIND_COLOURS = {"edges": "#0072B2", "shadow_edges": "#6A1B4D", "near_light": "#E69F00", "rest": "#b8bec6"}

#: Panels of the study: column, title, factor that makes it what the title says, and whether the axis is logarithmic.
PANELS = (
    ("psnr", "PSNR (dB)", 1.0, False),
    ("ssim", "SSIM", 1.0, False),
    ("flip", "HDR-FLIP", 1.0, False),
    ("albedo_l1", "albedo error (%)", 100.0, False),
    ("position_error", "light: position error (%)", 100.0, True),
)
SCENE_COLOURS = ("#0072B2", "#E69F00", "#6A1B4D", "#009E73", "#56B4E9", "#222222")
SCENE_MARKERS = "os^Dv*"
#: Lines of the clean case and of true surfels.
CLEAN_LINE, TRUTH_LINE = "-", (0, (1.0, 1.5))
#: How far apart the scenes of a case stand, in rows.
SCENE_STEP = 0.16


def split_figure(split: pd.DataFrame) -> Figure:
    """Stacked bars of the mean squared error by kind of pixel, one for each scene and way to evaluate light.

    Args:
        split: rows with `surfels`, `light`, `kind`, `pixels`, `error` (a share) and `psnr` within the kind.

    Raises:
        ValueError: the table is empty.
    """
    if split.empty:
        raise ValueError("the dataset has no passes by which pixels could be told apart")
    # Light at centres first: from the coarsest to the best that could be.
    groups = list(split.assign(order=split["light"] != "centres").groupby(["order", "surfels"], sort=True))
    shares = split.drop_duplicates("kind").set_index("kind")["pixels"]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.6, 1.3 + 0.42 * len(groups)), layout="constrained")
        axis = figure.subplots()
        for place, (_, group) in enumerate(reversed(groups)):
            _stacked_bar(axis, place, group.set_index("kind"))
        names = [f"{SURFELS[g['surfels'].iloc[0]]}, light at {g['light'].iloc[0]}" for _, g in reversed(groups)]
        axis.set_yticks(range(len(groups)), names)
        axis.set_xlabel("squared error over peak² (1e-4), mean over held-out views, and as PSNR")
        axis.grid(True, axis="x")
        axis.set_axisbelow(True)
        handles = [matplotlib.patches.Patch(color=KIND_COLOURS[k]) for k in KINDS]
        labels = [f"{KIND_LABELS[k]} ({100 * shares.get(k, 0.0):.1f} % of pixels)" for k in KINDS]
        figure.legend(handles, labels, loc="outside upper center", ncols=2, fontsize=8)
    return figure


def study_figure(table: pd.DataFrame) -> Figure:
    """Every measure over the cases, a panel each; scenes by colour and marker.

    A stalk joins each case to the clean one of its scene; the dotted line is what true surfels reach.

    Args:
        table: rows of `study_row`.

    Raises:
        ValueError: the table is empty.
    """
    if table.empty:
        raise ValueError("the study has no rows")
    cases = [case for case in dict.fromkeys(table["case"]) if case != TRUTH]
    panels = [panel for panel in PANELS if panel[0] in table.columns and table[panel[0]].notna().any()]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(2.4 + 2.1 * len(panels), 1.5 + 0.3 * len(cases)), layout="constrained")
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axis, panel in zip(axes, panels, strict=True):
            _study_panel(axis, table, cases, panel)
        axes[0].set_yticks(range(len(cases)), [case.replace("_", " ") for case in cases])
        axes[0].set_ylim(len(cases) - 0.5, -0.5)
        lines = [Line2D([], [], color=INK, lw=0.9, ls=style) for style in (CLEAN_LINE, TRUTH_LINE)]
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend([*handles, *lines], [*labels, "clean capture", TRUTH], loc="outside upper center", ncols=8)
    return figure


def _stacked_bar(axis: Axes, place: int, group: pd.DataFrame) -> None:
    """The parts of one scene's error; its total is their sum, as a PSNR beside the bar."""
    absolute = group["pixels"] * 10.0 ** (-0.1 * group["psnr"])
    absolute = absolute.fillna(0.0).reindex(list(KINDS), fill_value=0.0)
    left = 0.0
    for kind, value in absolute.items():
        axis.barh(place, 1e4 * value, left=left, height=0.62, color=KIND_COLOURS[kind])
        left += 1e4 * value
    if left > 0.0:
        axis.annotate(
            f"{-10.0 * np.log10(1e-4 * left):.1f} dB",
            (left, place),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            annotation_clip=False,
        )


def _study_panel(axis: Axes, table: pd.DataFrame, cases: list[str], panel: tuple[str, str, float, bool]) -> None:
    column, title, factor, logarithmic = panel
    scenes = list(table.groupby("scene", sort=False))
    for index, (scene, group) in enumerate(scenes):
        colour, marker = SCENE_COLOURS[index % 6], SCENE_MARKERS[index % 6]
        values = group.drop_duplicates("case").set_index("case")[column] * factor
        shift = SCENE_STEP * (index - 0.5 * (len(scenes) - 1))
        known = [(values[case], place + shift) for place, case in enumerate(cases) if case in values.index]
        axis.plot(*zip(*known, strict=True), marker, color=colour, ms=5, label=scene)
        if CLEAN in values.index:
            for value, place in known:
                axis.plot([values[CLEAN], value], [place, place], "-", color=colour, lw=1.2, alpha=0.5, zorder=1)
        for name, style in ((CLEAN, CLEAN_LINE), (TRUTH, TRUTH_LINE)):
            if name in values.index and np.isfinite(values[name]):
                axis.axvline(values[name], color=colour, lw=0.9, ls=style, alpha=0.7, zorder=0)
    axis.set_title(title)
    axis.grid(True, axis="x")
    if logarithmic:
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.xaxis.set_minor_formatter(NullFormatter())
