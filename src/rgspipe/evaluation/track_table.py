"""The table and the drawing of lights that were followed through a sequence."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rgspipe.evaluation import metrics, plots
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.scene_drawing import PANELS, TRUTH, draw_surfaces, frame_panel, window
from rgspipe.evaluation.tables import match_positions
from rgspipe.fitting.track import TrackedFrame
from rgspipe.scene import Light, LightRig, SpotLight

#: Colours of the lights, in turn.
COLOURS = ("#0072B2", "#E69F00", "#6A1B4D", "#2DB58A")

#: Length of a spot's axis in the drawing, parts of its longest side.
REACH = 0.05


def track_table(
    frames: Sequence[TrackedFrame], names: Sequence[str], truths: Sequence[LightRig], scene_size: float
) -> pd.DataFrame:
    """One row a light and frame (one without a light where none was found).

    Columns: frame, target, status, result, cost, seconds, evaluations, light, type, x, y, z, r, g, b, and of spots ax,
    ay, az, cone_angle [rad]; where the truth is known position_error (parts of the scene's size), intensity_error and,
    of spots, axis_error [degrees].
    """
    rows = []
    for index, (frame, name) in enumerate(zip(frames, names, strict=True)):
        result = frame.result
        told = {"frame": index, "target": name, "status": str(frame.status), "result": str(result.status)}
        told |= {"cost": frame.cost, "seconds": round(result.seconds, 4), "evaluations": result.evaluations}
        errors = _errors(result.lights, truths[index] if truths else (), scene_size)
        rows += [told | {"light": k} | _light(light) | errors[k] for k, light in enumerate(result.lights)] or [told]
    return pd.DataFrame(rows)


def track_figure(
    table: pd.DataFrame, truths: Sequence[LightRig], cloud: ArrayLike, normals: ArrayLike, cameras: ArrayLike
) -> Figure:
    """The track from above and from the side: found lights as dots along lines, the true ones as crosses.

    Args:
        table: of `track_table`.
        truths: per frame; empty where they are not known.
        cloud, normals: (N, 3) of the scene's surfels.
        cameras: (V, 3) origins.
    """
    points, facing, eyes = to_array(cloud), to_array(normals), to_array(cameras).reshape(-1, 3)
    found = table.dropna(subset=["x"]) if "x" in table else table.iloc[:0]
    true = np.array([light.position.tolist() for rig in truths for light in rig]).reshape(-1, 3)
    places = found[["x", "y", "z"]].to_numpy() if len(found) else np.zeros((0, 3))
    low, high = window(np.concatenate([points, eyes, places, true]))
    with matplotlib.rc_context(plots.STYLE):
        figure = Figure(figsize=(10.0, 5.0), layout="constrained")
        axes = figure.subplots(1, 2)
        for axis, (title, across, up) in zip(axes, PANELS, strict=True):
            draw_surfaces(axis, points, facing, across, up)
            axis.plot(eyes[:, across], eyes[:, up], "^", color="#8a9099", ms=6, mew=0, label="camera")
            axis.plot(true[:, across], true[:, up], "+", color=TRUTH, ms=6, mew=1.0, label="truth")
            _tracks(axis, found, across, up, REACH * float((high - low).max()))
            frame_panel(axis, title, across, up, low, high)
        axes[0].legend(fontsize=8)
    return figure


def _tracks(axis: Axes, found: pd.DataFrame, across: int, up: int, reach: float) -> None:
    for light, rows in found.groupby("light"):
        colour = COLOURS[int(light) % len(COLOURS)]
        places = rows[["x", "y", "z"]].to_numpy()
        label = f"light {int(light) + 1}"
        axis.plot(places[:, across], places[:, up], "o-", color=colour, ms=3.5, lw=0.8, mew=0, label=label)
        anew = rows["status"].isin(["redetected", "lost"]).to_numpy()
        axis.plot(places[anew, across], places[anew, up], "o", color="none", mec=colour, ms=8)
        if "ax" in rows:
            ends = places + reach * rows[["ax", "ay", "az"]].to_numpy()
            for start, end in zip(places, ends, strict=True):
                axis.plot([start[across], end[across]], [start[up], end[up]], "-", color=colour, lw=0.8)


def _light(light: Light) -> dict[str, object]:
    named: dict[str, object] = {"type": "spot" if isinstance(light, SpotLight) else "point"}
    named |= dict(zip("xyzrgb", [*light.position.tolist(), *light.intensity.tolist()], strict=True))
    if isinstance(light, SpotLight):
        named |= dict(zip(("ax", "ay", "az"), light.direction.tolist(), strict=True))
        named["cone_angle"] = light.cone_angle
    return named


def _errors(rig: LightRig, truth: LightRig, scene_size: float) -> list[dict[str, float]]:
    """Per light of a frame its errors; none where it has no counterpart."""
    errors: list[dict[str, float]] = [{} for _ in rig]
    if not rig or not truth:
        return errors
    for k, j in match_positions(*([light.position.tolist() for light in lights] for lights in (rig, truth))):
        one, other = rig[k], truth[j]
        errors[k]["position_error"] = metrics.position_error(one.position, other.position, scene_size)
        errors[k]["intensity_error"] = metrics.intensity_error(one.intensity, other.intensity)
        if isinstance(one, SpotLight) and isinstance(other, SpotLight):
            errors[k]["axis_error"] = metrics.angle_between(one.direction, other.direction)
    return errors
