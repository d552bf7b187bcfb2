"""How methods go from their start to their answer: errors over steps and seconds, and the way of the light."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rgspipe.evaluation import plots
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.convergence import light_positions
from rgspipe.evaluation.scene_drawing import PANELS, TRUTH, draw_surfaces, frame_panel, window
from rgspipe.scene import LightRig

#: Colours and dashes of the methods: finite differences walk where search_lm does.
COLOURS = {"search_lm": "#0072B2", "paper_adam": "#E69F00", "finite_differences": "#6A1B4D"}
DASHES = {"finite_differences": (0, (3, 2))}

MEASURES = (
    ("position_error", "position error (fraction of scene)"),
    ("intensity_error", "relative intensity error"),
    ("image_error", "squared error of the image"),
)

#: A way that leaves the scene is followed so far, fraction of its longest side.
BEYOND = 1.0


def course_figure(
    courses: pd.DataFrame, truth: LightRig, cloud: ArrayLike, normals: ArrayLike, cameras: ArrayLike
) -> Figure:
    """One target: three measures against the step and against seconds, and the ways of the lights.

    Args:
        courses: rows of `course_table` of each method, with `target`, `method` and `image_error` beside them.
        truth: empty if unknown.
        cloud, normals: (N, 3) of the scene's surfels.
        cameras: (V, 3) origins.
    """
    with matplotlib.rc_context(plots.STYLE):
        figure = Figure(figsize=(10.5, 10.0), layout="constrained")
        upper, lower = figure.subfigures(2, 1, height_ratios=(5.2, 4.8))
        _measures(upper.subplots(2, 3), courses)
        surfaces, eyes = (to_array(cloud), to_array(normals)), to_array(cameras).reshape(-1, 3)
        in_sight = _ways(lower.subplots(1, 2), courses, truth, *surfaces, eyes)
        handles = [_handle(str(name)) for name in dict.fromkeys(courses["method"])]
        handles += _marks(bool(truth), in_sight)
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8.5)
    return figure


def courses_figure(courses: pd.DataFrame) -> Figure:
    """All targets: three measures against the step and against seconds, a line a target and method.

    Args:
        courses: as for `course_figure`.
    """
    with matplotlib.rc_context(plots.STYLE):
        figure = Figure(figsize=(10.5, 5.6), layout="constrained")
        _measures(figure.subplots(2, 3), courses)
        handles = [_handle(str(name)) for name in dict.fromkeys(courses["method"])]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8.5)
    return figure


def _measures(axes: npt.NDArray, courses: pd.DataFrame) -> None:
    """Each measure against the step above, against seconds below."""
    for row, (clock, label) in enumerate((("step", "step"), ("seconds", "time (s)"))):
        for axis, (name, title) in zip(axes[row], MEASURES, strict=True):
            _curves(axis, courses, clock, name)
            axis.set(xlabel=label, title=title if row == 0 else "")


def _curves(axis: Axes, courses: pd.DataFrame, clock: str, name: str) -> None:
    axis.grid(True)
    axis.set_yscale("log")
    if courses[name].notna().any():
        for (_, method), course in courses.groupby(["target", "method"], sort=False):
            values = np.maximum(course[name].to_numpy(dtype=float), 1e-6)
            style = {"color": _colour(str(method)), "ls": DASHES.get(str(method), "-")}
            axis.plot(course[clock], values, lw=1.5, **style)
            axis.plot(course[clock].iloc[-1:], values[-1:], "o", ms=4, color=_colour(str(method)))
    else:
        axis.text(0.5, 0.5, "truth unknown", transform=axis.transAxes, ha="center", color="#777777")
    if clock == "step":
        axis.set_xscale("symlog", linthresh=1.0)
        axis.set_xlim(left=0.0)
    else:
        axis.set_xscale("log")


def _ways(
    axes: Sequence[Axes],
    courses: pd.DataFrame,
    truth: LightRig,
    points: npt.NDArray,
    facing: npt.NDArray,
    eyes: npt.NDArray,
) -> bool:
    """Draw both panels; whether a camera is in sight."""
    true = np.array([light.position.tolist() for light in truth]).reshape(-1, 3)
    ways = [(str(method), way) for method, course in courses.groupby("method", sort=False) for way in _lights(course)]
    low, high = points.min(axis=0), points.max(axis=0)
    reach = BEYOND * float((high - low).max())
    near = [np.clip(way, low - reach, high + reach) for _, way in ways]
    low, high = window(np.concatenate([points, true, *near]))
    for axis, (title, across, up) in zip(axes, PANELS, strict=True):
        draw_surfaces(axis, points, facing, across, up)
        for method, way in ways:
            style = {"color": _colour(method), "ls": DASHES.get(method, "-")}
            axis.plot(way[:, across], way[:, up], marker=".", ms=3.5, lw=1.1, **style)
            axis.plot(*way[0, [across, up]], "s", ms=6, mfc="white", mec=_colour(method), zorder=4)
            axis.plot(*way[-1, [across, up]], "o", ms=6, color=_colour(method), zorder=4)
        axis.plot(true[:, across], true[:, up], "+", color=TRUTH, ms=12, mew=1.6, zorder=5)
        axis.plot(eyes[:, across], eyes[:, up], "^", color="#8a9099", ms=6, mew=0)
        frame_panel(axis, title, across, up, low, high)
    inside = (eyes >= low) & (eyes <= high)
    return any(bool(inside[:, [across, up]].all(axis=1).any()) for _, across, up in PANELS)


def _lights(course: pd.DataFrame) -> list[npt.NDArray]:
    """(steps, 3) of each light."""
    ways = [way[np.isfinite(way).all(axis=1)] for way in np.moveaxis(light_positions(course), 1, 0)]
    return [way for way in ways if len(way)]


def _colour(method: str) -> str:
    return COLOURS.get(method, plots.OTHER_COLOUR)


def _handle(method: str) -> Line2D:
    return Line2D([], [], color=_colour(method), ls=DASHES.get(method, "-"), lw=1.8, label=method)


def _marks(truth: bool, cameras: bool) -> list[Line2D]:
    marks = [
        Line2D([], [], ls="", marker="s", mfc="white", mec=TRUTH, ms=6, label="start"),
        Line2D([], [], ls="", marker="o", color=TRUTH, ms=6, label="answer"),
    ]
    marks += [Line2D([], [], ls="", marker="+", color=TRUTH, ms=10, mew=1.6, label="truth")] if truth else []
    return marks + (
        [Line2D([], [], ls="", marker="^", color="#8a9099", ms=6, mew=0, label="camera")] if cameras else []
    )
