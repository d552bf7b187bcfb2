"""The figure of a study of captures under unknown lamps."""

from __future__ import annotations

import math

import matplotlib
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from rgspipe.evaluation.plots import STYLE

COLOURS = ("#0072B2", "#E69F00", "#6A1B4D", "#009E73", "#56B4E9", "#222222")


def lamps_figure(table: pd.DataFrame) -> Figure:
    """Errors of places, a dot a lamp, by case; colours say where the lamp was, a bar is the median.

    Lamps that were missed count in the median, and have no dot.
    """
    shown = table[table["position_error"].notna()]
    cases, groups = list(dict.fromkeys(table["case"])), list(dict.fromkeys(shown["where"]))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 1.2 + 0.5 * len(cases)), layout="constrained")
        axis = figure.subplots()
        for place, group in enumerate(groups):
            for row, case in enumerate(cases):
                errors = 100.0 * shown[(shown["case"] == case) & (shown["where"] == group)]["position_error"]
                height, colour = row + 0.7 * ((place + 0.5) / len(groups) - 0.5), COLOURS[place % len(COLOURS)]
                label = group.replace("_", " ") if row == 0 else None
                axis.scatter(errors, [height] * len(errors), s=14, color=colour, alpha=0.7, lw=0, label=label)
                if len(errors) and math.isfinite(errors.median()):
                    axis.scatter([errors.median()], [height], marker="|", s=160, color=colour)
        if groups:
            axis.set_xscale("log")
        axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set_yticks(range(len(cases)), cases)
        axis.set_ylim(len(cases) - 0.5, -0.5)
        axis.set_xlabel("position error (% of the room)")
        if groups:
            figure.legend(loc="outside upper center", ncols=len(groups))
    return figure
