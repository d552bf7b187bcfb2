"""Where a dataset's cameras and lights are, from above and from the side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rgspipe.evaluation import plots
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.classes import class_order
from rgspipe.evaluation.light_plot import CameraMark

SEEN, GUESSED = "#c4c9d0", "#e07a52"
TRAIN_CAMERA, TRAIN_LIGHT, TARGET_CAMERA = "#8a9099", "#c79a00", "#222222"
#: Length of a camera's viewing direction, fraction of the drawing's longest side.
REACH = 0.045
#: Inches: of the figure, of that both panels together, the height of titles and legend, and the most of all.
WIDTH, PANELS, BORDER, HIGHEST = 10.0, 8.4, 1.3, 8.0
#: Where coordinates are cut off, quantiles of all cameras: a far outlier does not shrink the rest.
FAR = (0.02, 0.98)


def plan_figure(
    cloud: ArrayLike | None,
    normals: ArrayLike | None,
    cameras: Sequence[CameraMark],
    lights: ArrayLike,
    targets: Mapping[str, ArrayLike],
    target_cameras: Sequence[CameraMark] = (),
    guessed: ArrayLike | None = None,
) -> Figure:
    """A drawing of a dataset, z up.

    Args:
        cloud: (N, 3) points of the scene's surfaces, drawn as grey dots, or None.
        normals: (N, 3) their normals; points that face the viewer are left out, so that walls stand out as lines.
        cameras: cameras of training views, lines along their viewing directions.
        lights: (L, 3) lights of training views.
        targets: by class, (K, 3) true lights of the targets.
        target_cameras: cameras of the targets.
        guessed: (N,) above 0 for points that no camera saw, drawn in a colour of their own.

    Raises:
        ValueError: there is nothing to draw.
    """
    lights = np.asarray(to_array(lights), dtype=float).reshape(-1, 3)
    origins = np.array([mark.origin for mark in (*cameras, *target_cameras)], dtype=float).reshape(-1, 3)
    points = None if cloud is None else to_array(cloud)
    placed = [np.asarray(to_array(found), dtype=float).reshape(-1, 3) for found in targets.values()]
    low, high = _window([part for part in (points, lights, *placed) if part is not None and len(part)], origins)
    facing = None if normals is None else to_array(normals)
    unseen = np.zeros(0 if points is None else len(points), bool) if guessed is None else to_array(guessed) > 0.0
    with matplotlib.rc_context(plots.STYLE):
        wide, deep, tall = (high - low).tolist()
        height = PANELS / (wide + deep) * max(deep, tall) + BORDER
        figure = Figure(figsize=(WIDTH, min(height, HIGHEST)), layout="constrained")
        axes = figure.subplots(1, 2, width_ratios=(wide, deep))
        for axis, title, across, up in zip(axes, ("from above", "from the side"), (0, 1), (1, 2), strict=True):
            if points is not None:
                for chosen, colour in ((~unseen, SEEN), (unseen, GUESSED)):
                    _cloud(axis, points[chosen], None if facing is None else facing[chosen], across, up, colour)
            _cameras(axis, cameras, across, up, REACH * float((high - low).max()), TRAIN_CAMERA, 0.8)
            _cameras(axis, target_cameras, across, up, 2.0 * REACH * float((high - low).max()), TARGET_CAMERA, 1.6)
            axis.plot(lights[:, across], lights[:, up], "+", color=TRAIN_LIGHT, ms=5, mew=1.0, zorder=3)
            for name, found in zip(targets, placed, strict=True):
                marker = plots.MARKERS.get(name, plots.OTHER_MARKER)
                axis.plot(found[:, across], found[:, up], marker, color=plots.colour_of(name), ms=5, mew=0, zorder=4)
            axis.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]), aspect="equal", anchor="S")
            axis.set_xlabel(f"{'xyz'[across]} (scene units)")
            axis.set_ylabel(f"{'xyz'[up]} (scene units)")
            axis.set_title(title)
        handles = _handles(bool(cameras), bool(len(lights)), targets, bool(target_cameras))
        if unseen.any():
            words = "surface that no camera saw, added"
            handles.append(Line2D([], [], color=GUESSED, marker=".", ls="", ms=5, label=words))
        figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8.5)
    return figure


def _window(parts: Sequence[npt.NDArray], origins: npt.NDArray) -> tuple[npt.NDArray, npt.NDArray]:
    """Corners (3,) of what is drawn, with a margin."""
    if len(origins) > 1:
        parts = [*parts, np.quantile(origins, FAR, axis=0)]
    elif len(origins):
        parts = [*parts, origins]
    if not parts:
        raise ValueError("neither cameras nor lights are known")
    together = np.concatenate(parts)
    low, high = together.min(axis=0), together.max(axis=0)
    margin = 0.06 * max(float((high - low).max()), 1e-6)
    return low - margin, high + margin


def _cloud(axis: Axes, points: npt.NDArray, facing: npt.NDArray | None, across: int, up: int, colour: str) -> None:
    along = 3 - across - up
    if facing is not None:
        points = points[np.abs(facing[:, along]) < 0.7]
    points = plots.thinned(points)
    axis.plot(points[:, across], points[:, up], ".", ms=1.4, color=colour, mew=0, zorder=0)


def _cameras(
    axis: Axes, cameras: Sequence[CameraMark], across: int, up: int, length: float, colour: str, width: float
) -> None:
    for mark in cameras:
        start = np.array([mark.origin[across], mark.origin[up]])
        end = start + length * np.array([mark.direction[across], mark.direction[up]])
        axis.plot(*np.stack([start, end]).T, "-", color=colour, lw=width, zorder=2)
        axis.plot(*start, "o", color=colour, ms=2.5 * width, mew=0, zorder=2)


def _handles(cameras: bool, lights: bool, targets: Mapping[str, ArrayLike], target_cameras: bool) -> list[Line2D]:
    handles = []
    if cameras:
        handles.append(
            Line2D([], [], color=TRAIN_CAMERA, marker="o", ms=2.5, lw=0.9, label="camera of a training view")
        )
    if lights:
        handles.append(Line2D([], [], color=TRAIN_LIGHT, marker="+", ls="", label="light of a training view"))
    if target_cameras:
        handles.append(Line2D([], [], color=TARGET_CAMERA, marker="o", ms=4, lw=1.6, label="camera of the targets"))
    for name in class_order(list(targets)):
        marker = plots.MARKERS.get(name, plots.OTHER_MARKER)
        words = f"target’s light: {plots.LABELS.get(name, name)}"
        handles.append(Line2D([], [], color=plots.colour_of(name), marker=marker, ls="", ms=5, label=words))
    return handles
