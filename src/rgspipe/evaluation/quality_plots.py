"""A figure of trained scenes: where their error sits."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.held_out import SURFELS
from rgspipe.evaluation.plots import STYLE

#: Kinds of pixels in words, and their colours.
KIND_LABELS = {
    "edges": "silhouettes and creases",
    "shadow_edges": "edges of shadows",
    "near_light": "near the light",
    "rest": "the rest",
}
KIND_COLOURS = {"edges": "#0072B2", "shadow_edges": "#6A1B4D", "near_light": "#E69F00", "rest": "#b8bec6"}


def split_figure(split: pd.DataFrame) -> Figure:
    """Stacked bars of the mean squared error by kind of pixel, one for each scene and way to evaluate light.

    Args:
        split: rows with `surfels`, `light`, `kind`, `pixels`, `error` (a share) and `psnr` within the kind.

    Raises:
        ValueError: the table is empty.
    """
    if split.empty:
        raise ValueError("the dataset has no passes by which pixels could be told apart")
    # Light at centres first: from the coarsest to the best that could be.
    groups = list(split.assign(order=split["light"] != "centres").groupby(["order", "surfels"], sort=True))
    shares = split.drop_duplicates("kind").set_index("kind")["pixels"]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.6, 1.3 + 0.42 * len(groups)), layout="constrained")
        axis = figure.subplots()
        for place, (_, group) in enumerate(reversed(groups)):
            _stacked_bar(axis, place, group.set_index("kind"))
        names = [f"{SURFELS[g['surfels'].iloc[0]]}, light at {g['light'].iloc[0]}" for _, g in reversed(groups)]
        axis.set_yticks(range(len(groups)), names)
        axis.set_xlabel("squared error over peak² (1e-4), mean over held-out views, and as PSNR")
        axis.grid(True, axis="x")
        axis.set_axisbelow(True)
        handles = [matplotlib.patches.Patch(color=KIND_COLOURS[k]) for k in KINDS]
        labels = [f"{KIND_LABELS[k]} ({100 * shares.get(k, 0.0):.1f} % of pixels)" for k in KINDS]
        figure.legend(handles, labels, loc="outside upper center", ncols=2, fontsize=8)
    return figure


def _stacked_bar(axis: Axes, place: int, group: pd.DataFrame) -> None:
    """The parts of one scene's error; its total is their sum, as a PSNR beside the bar."""
    absolute = group["pixels"] * 10.0 ** (-0.1 * group["psnr"])
    absolute = absolute.fillna(0.0).reindex(list(KINDS), fill_value=0.0)
    left = 0.0
    for kind, value in absolute.items():
        axis.barh(place, 1e4 * value, left=left, height=0.62, color=KIND_COLOURS[kind])
        left += 1e4 * value
    if left > 0.0:
        axis.annotate(
            f"{-10.0 * np.log10(1e-4 * left):.1f} dB",
            (left, place),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            annotation_clip=False,
        )
