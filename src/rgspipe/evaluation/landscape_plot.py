"""A drawing of slices through the loss, with the way that the fit took."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rgspipe.datasets.landscape_file import PLANES, Landscape, PlaneLoss
from rgspipe.evaluation import plots
from rgspipe.evaluation.arrays import ArrayLike, to_array

#: Contours between the least and the largest loss, evenly on a logarithmic scale.
LEVELS = 18
START, ANSWER, TRUTH = "#2DB58A", "#E69F00", "#D7263D"


def landscape_figure(landscape: Landscape, truth: ArrayLike | None = None) -> Figure:
    """The loss on three planes through the answer, as contours.

    Args:
        truth: (3,) the true position, where it is known.
    """
    with matplotlib.rc_context(plots.STYLE):
        figure = Figure(figsize=(10.0, 3.9), layout="constrained")
        for axis, name in zip(figure.subplots(1, len(PLANES)), PLANES, strict=True):
            seen = ["xyz".index(letter) for letter in name]
            _contours(axis, landscape.planes[name])
            _course(axis, landscape.trajectory[:, seen], None if truth is None else to_array(truth)[seen])
            axis.set_xlabel(f"{name[0]} (scene units)")
            axis.set_ylabel(f"{name[1]} (scene units)")
        figure.legend(handles=_handles(truth is not None), loc="outside lower center", ncols=4, fontsize=8.5)
    return figure


def _contours(axis: Axes, plane: PlaneLoss) -> None:
    across, up, loss = plane.across, plane.up, plane.loss
    known = loss[np.isfinite(loss) & (loss > 0.0)]
    axis.set(aspect="equal", xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))
    if known.size == 0 or known.min() == known.max():
        return
    low, high = math.log10(known.min()), math.log10(known.max())
    shown = np.ma.masked_invalid(np.log10(np.clip(loss, 10.0**low, None)))
    levels = np.linspace(low, high, LEVELS)
    axis.contourf(across, up, shown, levels=levels, cmap="Blues_r", alpha=0.8)
    axis.contour(across, up, shown, levels=levels, colors="#40506a", linewidths=0.35, linestyles="solid")
    axis.set_title(f"loss {10.0**low:.2g} to {10.0**high:.2g}")


def _course(axis: Axes, path: npt.NDArray, truth: npt.NDArray | None) -> None:
    axis.plot(*path.T, ".-", color=plots.INK, lw=0.8, ms=2.5, zorder=3)
    axis.plot(*path[0], "s", color=START, ms=5.0, mew=0, zorder=4)
    if truth is not None:
        axis.plot(*truth, "x", color=TRUTH, ms=6.5, mew=1.5, zorder=5)
    axis.plot(*path[-1], "o", mfc="none", mec=ANSWER, ms=7.5, mew=1.6, zorder=6)


def _handles(truth: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], marker="s", ls="", color=START, ms=5.0, label="start"),
        Line2D([], [], marker=".", color=plots.INK, lw=0.8, ms=3.0, label="steps"),
        Line2D([], [], marker="o", ls="", mfc="none", mec=ANSWER, ms=7.0, label="answer"),
    ]
    if truth:
        handles.append(Line2D([], [], marker="x", ls="", color=TRUTH, ms=6.0, mew=1.5, label="truth"))
    return handles
