"""The figure of what bad captures cost."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rgspipe.evaluation.plots import INK, STYLE
from rgspipe.studies.captures import CLEAN, TRUTH

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


def capture_figure(table: pd.DataFrame) -> Figure:
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
            _panel(axis, table, cases, panel)
        axes[0].set_yticks(range(len(cases)), [case.replace("_", " ") for case in cases])
        axes[0].set_ylim(len(cases) - 0.5, -0.5)
        lines = [Line2D([], [], color=INK, lw=0.9, ls=style) for style in (CLEAN_LINE, TRUTH_LINE)]
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend([*handles, *lines], [*labels, "clean capture", TRUTH], loc="outside upper center", ncols=8)
    return figure


def _panel(axis: Axes, table: pd.DataFrame, cases: list[str], panel: tuple[str, str, float, bool]) -> None:
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
