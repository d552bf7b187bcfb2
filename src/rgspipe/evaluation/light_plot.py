"""True and recovered lights where they are in the scene, from above and from the side."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse

from rgspipe.evaluation import calibration
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.plots import INK, MARKERS, OTHER_MARKER, STYLE, class_legend, colour_of, thinned

#: How far beyond scene and lights the drawing reaches to show cameras, fraction of the scene's longest side.
CAMERA_MARGIN = 0.3


@dataclass(frozen=True)
class CameraMark:
    """A camera as it is drawn: origin (3,), viewing direction (3,), horizontal field of view [rad]."""

    origin: tuple[float, float, float]
    direction: tuple[float, float, float]
    angle: float


def light_figure(
    targets: pd.DataFrame, cloud: ArrayLike, normals: ArrayLike | None = None, cameras: Sequence[CameraMark] = ()
) -> Figure:
    """True and recovered lights in the scene, from above and from the side (z is up).

    Args:
        targets: rows of `target_table` of one method and view count.
        cloud: (N, 3) surfel centres, drawn as grey dots.
        normals: (N, 3) surfel normals; where given, surfels that face the viewer (floor and ceiling
            from above) are left out, so that walls and objects stand out as outlines.
        cameras: drawn as triangles that open in the viewing direction; those far outside the scene are
            drawn nearer, on their line of sight.
    """
    points = to_array(cloud)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"the cloud must have shape (N, 3), got {points.shape}")
    facing = None if normals is None else to_array(normals)
    low, high = _extent(points, targets)
    margin = 0.05 * float((high - low).max())
    marks = [nearer(camera, low, high) for camera in cameras]
    origins = np.array([mark.origin for mark in marks]).reshape(-1, 3)
    low = np.minimum(low, origins.min(axis=0, initial=math.inf)) - margin
    high = np.maximum(high, origins.max(axis=0, initial=-math.inf)) + margin
    depth = _viewing_axis(cameras)
    panels = (("from above", 0, 1, 2), ("from the side", depth, 2, 1 - depth))
    with matplotlib.rc_context(STYLE):
        widths = [float((high - low)[across]) for _, across, _, _ in panels]
        figure = Figure(figsize=(10.0, 5.4), layout="constrained")
        for axis, (title, across, up, along) in zip(figure.subplots(1, 2, width_ratios=widths), panels, strict=True):
            window = np.stack([low, high])[:, [across, up]]
            _cloud(axis, points, facing, across, up, along)
            for mark in marks:
                _camera(axis, mark, across, up, size=2.2 * margin)
            outside = _lights(axis, targets, window, across, up)
            axis.set(xlim=window[:, 0], ylim=window[:, 1], aspect="equal", anchor="S")
            axis.set_xlabel(f"{'xyz'[across]} (scene units)")
            axis.set_ylabel(f"{'xyz'[up]} (scene units)")
            axis.set_title(title + (f" ({outside} estimates lie outside)" if outside else ""))
        class_legend(figure, targets["occlusion"], extra=_light_handles(bool(cameras)))
    return figure


def _extent(points: npt.NDArray, targets: pd.DataFrame) -> tuple[npt.NDArray, npt.NDArray]:
    """Corners (3,) of scene and true lights; wild estimates do not widen the drawing."""
    true_lights = targets[["x_true", "y_true", "z_true"]].dropna().to_numpy(dtype=float)
    together = np.concatenate([points, true_lights])
    if not len(together):
        return np.zeros(3), np.ones(3)
    low, high = together.min(axis=0), together.max(axis=0)
    return low, np.maximum(high, low + 1e-6)


def nearer(camera: CameraMark, low: npt.NDArray, high: npt.NDArray) -> CameraMark:
    """The camera moved along its viewing direction until it is within `CAMERA_MARGIN` of the scene, if it can be."""
    reach = CAMERA_MARGIN * float((high - low).max())
    origin, direction = np.array(camera.origin, dtype=float), np.array(camera.direction, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        entries = np.fmin((low - reach - origin) / direction, (high + reach - origin) / direction)
        exits = np.fmax((low - reach - origin) / direction, (high + reach - origin) / direction)
    enter, leave = float(np.nanmax(entries)), float(np.nanmin(exits))
    if enter <= 0.0 or leave < enter:
        return camera
    return CameraMark(tuple((origin + enter * direction).tolist()), camera.direction, camera.angle)


def _viewing_axis(cameras: Sequence[CameraMark]) -> int:
    """0 or 1: the horizontal axis that the cameras look along, so that a side view shows depth; y without any."""
    if not cameras:
        return 1
    mean = np.abs(np.mean([camera.direction for camera in cameras], axis=0))
    return 0 if mean[0] > mean[1] else 1


def _cloud(axis: Axes, points: npt.NDArray, facing: npt.NDArray | None, across: int, up: int, along: int) -> None:
    if facing is not None:
        points = points[np.abs(facing[:, along]) < 0.7]
    points = thinned(points)
    axis.plot(points[:, across], points[:, up], ".", ms=1.6, color="#b9bec5", mew=0, zorder=0, rasterized=True)


def _camera(axis: Axes, camera: CameraMark, across: int, up: int, size: float) -> None:
    origin = np.array([camera.origin[across], camera.origin[up]])
    forward = np.array([camera.direction[across], camera.direction[up]])
    length = float(np.linalg.norm(forward))
    if length < 1e-6:
        axis.plot(*origin, "s", ms=4, color="#555b63")
        return
    # Foreshortened like the direction itself; the opening keeps its angle.
    forward = forward * size
    sideways = np.array([-forward[1], forward[0]]) / length * math.tan(0.5 * camera.angle)
    corners = np.stack([origin, origin + forward + sideways, origin + forward - sideways, origin])
    axis.fill(*corners.T, facecolor="#e3e6ea", edgecolor="#555b63", lw=0.9, zorder=2)


def _lights(axis: Axes, targets: pd.DataFrame, window: npt.NDArray, across: int, up: int) -> int:
    """Draw truths and estimates; returns how many estimates lie outside the window."""
    names = "xyz"[across], "xyz"[up]
    outside = 0
    for row in targets.to_dict("records"):
        colour = colour_of(row["occlusion"])
        estimate = np.array([row[name] for name in names], dtype=float)
        truth = np.array([row[f"{name}_true"] for name in names], dtype=float)
        if np.isfinite(truth).all() and np.isfinite(estimate).all():
            axis.plot(*np.stack([truth, estimate]).T, "-", color=colour, lw=0.9, alpha=0.8, zorder=3)
        _region(axis, row, across, up, colour)
        axis.plot(*truth, "x", color=colour, ms=5.5, mew=1.3, zorder=4)
        marker = MARKERS.get(row["occlusion"], OTHER_MARKER)
        axis.plot(*estimate, marker, ms=6.0, mfc="none", mec=colour, mew=1.1, zorder=5)
        outside += not ((estimate >= window[0]) & (estimate <= window[1])).all()
    return outside


def _region(axis: Axes, row: Mapping[str, object], across: int, up: int, colour: str) -> None:
    """The outline of the 95 % region of a recovered light, where the fit states one."""
    first, second = ("xyz"[k] for k in sorted((across, up)))
    names = (f"var_{first}{first}", f"var_{first}{second}", f"var_{second}{second}")
    one, both, two = (float(row.get(name, math.nan)) for name in names)
    # The smaller index comes first in the names, whichever of the two runs across.
    matrix = [[one, both], [both, two]] if across < up else [[two, both], [both, one]]
    outline = calibration.ellipse(matrix)
    place = (float(row["xyz"[across]]), float(row["xyz"[up]]))
    if outline is None or not np.isfinite(place).all():
        return
    width, height, angle = outline
    axis.add_patch(Ellipse(place, width, height, angle=angle, fc=colour, ec=colour, alpha=0.18, lw=0.8, zorder=3))


def _light_handles(cameras: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], marker="x", ls="", color=INK, ms=5.5, mew=1.3, label="truth"),
        Line2D([], [], marker="o", ls="", mfc="none", mec=INK, ms=6.0, label="estimate"),
        Line2D([], [], marker="o", ls="", mfc=INK, mew=0, alpha=0.25, ms=9.0, label="95 % region"),
    ]
    if cameras:
        camera = {"marker": ">", "ls": "", "mfc": "#e3e6ea", "mec": "#555b63"}
        handles.append(Line2D([], [], ms=7.0, label="camera", **camera))
    return handles
