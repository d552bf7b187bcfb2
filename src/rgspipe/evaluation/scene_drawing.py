"""A scene as figures of moving lights draw it: surfels seen from above and from the side."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from rgspipe.evaluation import plots

#: Panels: title, and the axes that run across and up.
PANELS = (("from above", 0, 1), ("from the side", 0, 2))

#: What the truth is drawn in.
TRUTH = "#222222"


def draw_surfaces(axis: Axes, points: npt.NDArray, normals: npt.NDArray, across: int, up: int) -> None:
    """Surfels (N, 3) that do not face the viewer, so that walls stand out as lines."""
    kept = plots.thinned(points[np.abs(normals[:, 3 - across - up]) < 0.7])
    axis.plot(kept[:, across], kept[:, up], ".", ms=1.4, color="#c4c9d0", mew=0, zorder=0)


def frame_panel(axis: Axes, title: str, across: int, up: int, low: npt.NDArray, high: npt.NDArray) -> None:
    """Limits, from the corners (3,) of what is shown, and names of the axes."""
    axis.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]), aspect="equal", title=title)
    axis.set_xlabel(f"{'xyz'[across]} (scene units)")
    axis.set_ylabel(f"{'xyz'[up]} (scene units)")


def window(points: npt.NDArray) -> tuple[npt.NDArray, npt.NDArray]:
    """Corners (3,) of the box of points (N, 3), with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * float((high - low).max())
    return low - margin, high + margin
