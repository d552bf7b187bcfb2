"""The table and the drawing of lights that were followed through a sequence."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rgspipe.evaluation import metrics, plots
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.rig_errors import match_positions
from rgspipe.evaluation.scene_drawing import PANELS, TRUTH, draw_surfaces, frame_panel, window
from rgspipe.fitting.tracking.frame import TrackedFrame
from rgspipe.scene import Light, LightRig

#: Colours of the lights, in turn.
COLOURS = ("#0072B2", "#E69F00", "#6A1B4D", "#2DB58A")

#: Length of a spot's axis in the drawing, parts of its longest side.
REACH = 0.05

#: Opacity of what is uncertain.
PALE = 0.35

#: Errors below this are drawn at it.
LEAST_ERROR = 1e-5


def track_table(
    frames: Sequence[TrackedFrame], names: Sequence[str], truths: Sequence[LightRig], scene_size: float
) -> pd.DataFrame:
    """One row a light and frame (one without a light where none was found).

    Columns: frame, target, status, result, cost, seconds, evaluations, light, type, and `Light.columns`; position_sd,
    the position error that is to be expected (parts of the scene's size; of suns the angle [rad]); where the truth is
    known position_error (the same), intensity_error and, of lights with an axis, axis_error [degrees].
    """
    rows = []
    for index, (frame, name) in enumerate(zip(frames, names, strict=True)):
        result = frame.result
        told = {"frame": index, "target": name, "status": str(frame.status), "result": str(result.status)}
        told |= {"cost": frame.cost, "seconds": round(result.seconds, 4), "evaluations": result.evaluations}
        errors = _errors(result.lights, truths[index] if truths else (), scene_size)
        expected = [{"position_sd": error} for error in frame.position_errors] or [{} for _ in result.lights]
        lights = zip(result.lights, expected, errors, strict=True)
        rows += [told | {"light": k} | _light(light) | sd | off for k, (light, sd, off) in enumerate(lights)] or [told]
    return pd.DataFrame(rows)


def track_figure(
    table: pd.DataFrame, truths: Sequence[LightRig], cloud: ArrayLike, normals: ArrayLike, cameras: ArrayLike
) -> Figure:
    """The track from above and from the side, and the errors of its frames.

    Found lights are dots along lines, pale where they are uncertain and circled where they were found anew or lost;
    true ones are crosses. Beside that the position errors, expected (dashed) and, where the truth is known, true.

    Args:
        table: of `track_table`.
        truths: per frame; empty where they are not known.
        cloud, normals: (N, 3) of the scene's surfels.
        cameras: (V, 3) origins.
    """
    points, facing, eyes = to_array(cloud), to_array(normals), to_array(cameras).reshape(-1, 3)
    found = table.dropna(subset=["x"]) if "x" in table else table.iloc[:0]
    true = np.array([light.position.tolist() for rig in truths for light in rig]).reshape(-1, 3)
    # A light that is quite unknown may be anywhere: the drawing shows the scene, cameras and true lights.
    low, high = window(np.concatenate([points, eyes, true]))
    with matplotlib.rc_context(plots.STYLE):
        figure = Figure(figsize=(12.5, 4.6), layout="constrained")
        *plans, errors = figure.subplots(1, 3)
        for axis, (title, across, up) in zip(plans, PANELS, strict=True):
            draw_surfaces(axis, points, facing, across, up)
            axis.plot(eyes[:, across], eyes[:, up], "^", color="#8a9099", ms=6, mew=0, label="camera")
            axis.plot(true[:, across], true[:, up], "+", color=TRUTH, ms=6, mew=1.0, label="truth")
            _tracks(axis, found, across, up, REACH * float((high - low).max()))
            frame_panel(axis, title, across, up, low, high)
        plans[0].legend(fontsize=8)
        _errors_by_frame(errors, found)
    return figure


def _tracks(axis: Axes, found: pd.DataFrame, across: int, up: int, reach: float) -> None:
    for light, rows in found.groupby("light"):
        colour = COLOURS[int(light) % len(COLOURS)]
        places = rows[["x", "y", "z"]].to_numpy()
        axis.plot(places[:, across], places[:, up], "-", color=colour, lw=0.8, alpha=PALE)
        known = _known(rows)
        label = f"light {int(light) + 1}"
        axis.plot(places[known, across], places[known, up], "o", color=colour, ms=3.5, mew=0, label=label)
        axis.plot(places[~known, across], places[~known, up], "o", color=colour, ms=3.5, mew=0, alpha=PALE)
        anew = rows["status"].isin(["redetected", "lost"]).to_numpy()
        axis.plot(places[anew, across], places[anew, up], "o", color="none", mec=colour, ms=8)
        if "ax" in rows:
            ends = places + reach * rows[["ax", "ay", "az"]].to_numpy()
            for start, end, sure in zip(places, ends, known, strict=True):
                alpha = 1.0 if sure else PALE
                line = ([start[across], end[across]], [start[up], end[up]])
                axis.plot(*line, "-", color=colour, lw=0.8, alpha=alpha)


def _known(rows: pd.DataFrame) -> npt.NDArray[np.bool_]:
    """Which rows have lights whose places are known."""
    return ~rows["status"].isin(["uncertain", "lost"]).to_numpy()


def _errors_by_frame(axis: Axes, found: pd.DataFrame) -> None:
    axis.grid(True)
    axis.set(yscale="log", xlabel="frame", title="position error (fraction of scene)")
    handles = []
    for light, rows in found.groupby("light"):
        colour, known = COLOURS[int(light) % len(COLOURS)], _known(rows)
        for name, style in (("position_sd", "--"), ("position_error", "-")):
            if name in rows:
                axis.plot(rows["frame"], rows[name].clip(lower=LEAST_ERROR), style, color=colour, lw=1.0)
        if "position_error" in rows:
            shown = rows["position_error"].clip(lower=LEAST_ERROR)
            axis.plot(rows["frame"][known], shown[known], "o", color=colour, ms=4, mew=0)
            axis.plot(rows["frame"][~known], shown[~known], "o", mfc="white", mec=colour, ms=4)
    if "position_error" in found:
        handles.append(Line2D([], [], color=TRUTH, lw=1.0, marker="o", ms=4, label="true"))
        handles.append(
            Line2D([], [], color=TRUTH, lw=1.0, marker="o", mfc="white", ms=4, label="true, uncertain frame")
        )
    if "position_sd" in found:
        handles.append(Line2D([], [], color=TRUTH, lw=1.0, ls="--", label="expected"))
    if handles:
        axis.legend(handles=handles, fontsize=8)


def _light(light: Light) -> dict[str, object]:
    return {"type": light.kind, **light.columns()}


def _errors(rig: LightRig, truth: LightRig, scene_size: float) -> list[dict[str, float]]:
    """Per light of a frame its errors; none where it has no counterpart."""
    errors: list[dict[str, float]] = [{} for _ in rig]
    if not rig or not truth:
        return errors
    found, wanted = ([light.standing(scene_size).tolist() for light in lights] for lights in (rig, truth))
    for k, j in match_positions(found, wanted):
        one, other = rig[k], truth[j]
        errors[k]["position_error"] = metrics.position_error(found[k], wanted[j], scene_size)
        errors[k]["intensity_error"] = metrics.intensity_error(one.intensity, other.intensity)
        if one.axis is not None and other.axis is not None:
            errors[k]["axis_error"] = metrics.angle_between(one.axis, other.axis)
    return errors
