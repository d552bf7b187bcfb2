"""Where the lights of generated targets are: some targets by number, the others as dots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rgspipe.evaluation import plots
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.scene_drawing import PANELS, TRUTH, draw_surfaces, frame_panel, window
from rgspipe.scene import LightRig

#: Colours of the targets that are shown, in turn.
COLOURS = ("#0072B2", "#E69F00", "#6A1B4D", "#2DB58A", "#56B4E9", "#D55E00")
OTHERS = "#9aa1a9"

#: Length of a spot's axis, parts of the drawing's longest side.
REACH = 0.08


def targets_figure(
    shown: Mapping[str, LightRig], others: Sequence[LightRig], cloud: ArrayLike, normals: ArrayLike, cameras: ArrayLike
) -> Figure:
    """Lights from above and from the side; spots have a line along their axis.

    Args:
        shown: by its label, the lights of each target that is named.
        others: lights of the others.
        cloud, normals: (N, 3) of the scene's surfels.
        cameras: (V, 3) origins of the targets' cameras.
    """
    points, facing, eyes = to_array(cloud), to_array(normals), to_array(cameras).reshape(-1, 3)
    placed = [light.position.tolist() for rig in (*shown.values(), *others) for light in rig]
    low, high = window(np.concatenate([points, eyes, np.array(placed).reshape(-1, 3)]))
    reach = REACH * float((high - low).max())
    with matplotlib.rc_context(plots.STYLE):
        figure = Figure(figsize=(10.0, 5.4), layout="constrained")
        for axis, (title, across, up) in zip(figure.subplots(1, 2), PANELS, strict=True):
            draw_surfaces(axis, points, facing, across, up)
            axis.plot(eyes[:, across], eyes[:, up], "^", color=TRUTH, ms=6, mew=0)
            for rig in others:
                _lights(axis, rig, across, up, 0.5 * reach, OTHERS, 2.5)
            for index, (label, rig) in enumerate(shown.items()):
                colour = COLOURS[index % len(COLOURS)]
                _lights(axis, rig, across, up, reach, colour, 6.0)
                for light in rig:
                    place = light.position.tolist()
                    offset = {"xytext": (5, 4), "textcoords": "offset points"}
                    axis.annotate(label, (place[across], place[up]), color=colour, fontweight="bold", **offset)
            frame_panel(axis, title, across, up, low, high)
        figure.legend(handles=_handles(bool(others)), loc="outside lower center", ncols=4, fontsize=8.5)
    return figure


def _lights(axis: Axes, rig: LightRig, across: int, up: int, reach: float, colour: str, size: float) -> None:
    for light in rig:
        place = np.array(light.position.tolist())
        if light.axis is not None:
            end = place + reach * np.array(light.axis.tolist()) / float(light.axis.norm())
            axis.plot(*np.stack([place, end])[:, [across, up]].T, "-", color=colour, lw=0.25 * size, zorder=3)
        axis.plot(place[across], place[up], "o", color=colour, ms=size, mew=0, zorder=4)


def _handles(others: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], ls="", marker="o", color=COLOURS[0], ms=6, label="light of a target shown below"),
        Line2D([], [], ls="", marker="^", color=TRUTH, ms=6, label="camera"),
    ]
    return [
        *handles,
        *([Line2D([], [], ls="", marker="o", color=OTHERS, ms=3, label="other targets")] if others else []),
    ]
