"""The room of a report in three dimensions: what the script of its drawing, room.js, is given."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd

from rgspipe.datasets.alternatives_file import ToldAlternative
from rgspipe.evaluation import calibration
from rgspipe.evaluation.light_plot import CameraMark, nearer
from rgspipe.evaluation.plots import OTHER_COLOUR, colour_of
from rgspipe.evaluation.tables import VARIANCES
from rgspipe.pages.html import label
from rgspipe.percent import percent
from rgspipe.scene import Surfels
from rgspipe.scene.srgb import encode

#: At most this many surfels are drawn, larger where there are more; 21 bytes each.
DRAWN = 4000

#: Half the sides of the rectangle that stands for a surfel, in its standard deviations.
REACH = 1.6

#: The longest half-axis of a region that is drawn, of the scene's size: it is cut off, not left out.
LONGEST = 2.0

#: What fits weighed against their answers, by method, number of views and target.
Alternatives: TypeAlias = Mapping[tuple[str, int, str], Sequence[ToldAlternative]]

#: Places are whole numbers up to this between the corners of the scene.
STEPS = 65535


@dataclass(frozen=True)
class LampMark:
    """A lamp that was on in the photographs of a capture.

    Attributes:
        name: "lamp 1".
        place: (3,) scene units.
        covariance: (3, 3) of the place, or None.
        told: what is known of the place, in words.
    """

    name: str
    place: npt.NDArray
    covariance: npt.NDArray | None
    told: str


def room_view(
    surfels: Surfels,
    targets: pd.DataFrame,
    cameras: Sequence[CameraMark],
    alternatives: Alternatives | None = None,
    captured: Sequence[LampMark] = (),
) -> dict[str, Any]:
    """Surfels, cameras and, by method and number of views, lights with their regions, as JSON has them.

    Args:
        targets: rows of `target_table`.
        captured: lamps that were on in the photographs which the scene was made from.
    """
    others = alternatives or {}
    centers = surfels.centers.double().numpy()
    low, high = centers.min(axis=0), centers.max(axis=0)
    size = float((high - low).max())
    return {
        "low": low.tolist(),
        "high": high.tolist(),
        "surfels": _surfels(surfels, low, size),
        "cameras": [vars(nearer(mark, low, high)) for mark in cameras],
        "captured": [_captured(mark, size) for mark in captured],
        "groups": [
            {
                "method": method,
                "views": int(views),
                "lights": [
                    _light(row, size) | {"others": [*map(_other, others.get((method, int(views), row["target"]), ()))]}
                    for row in group.to_dict("records")
                ],
            }
            for (method, views), group in targets.groupby(["method", "views"], sort=False)
        ],
    }


def _surfels(surfels: Surfels, low: npt.NDArray, size: float) -> dict[str, Any]:
    """A draw of them, those that are left out made up for by larger ones."""
    chosen = np.sort(np.random.default_rng(0).permutation(len(surfels))[:DRAWN])
    wider = math.sqrt(len(surfels) / len(chosen))
    sides = REACH * wider * (surfels.scales[..., None] * surfels.frames[:, :2])[chosen].double().numpy()
    colours = encode(surfels.albedo[chosen].clamp(0.0, 1.0).numpy())
    return {
        "count": len(chosen),
        "step": size / STEPS,
        "places": _packed((surfels.centers.double().numpy()[chosen] - low) / size * STEPS, np.uint16),
        "sides": _packed(sides / size * STEPS, np.int16),
        "colours": _packed(255.0 * colours, np.uint8),
    }


def _packed(values: npt.NDArray, kind: type[np.integer]) -> str:
    """Whole numbers, lowest byte first, as text."""
    limits = np.iinfo(kind)
    whole = np.clip(np.rint(values), limits.min, limits.max).astype(np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(whole.tobytes()).decode("ascii")


def _light(row: Mapping[str, Any], size: float) -> dict[str, Any]:
    error = row["position_error"]
    return {
        "target": str(row["target"]),
        "class": row["occlusion"],
        "label": label(row["occlusion"]),
        "colour": colour_of(row["occlusion"]),
        "found": _place(row, ""),
        "truth": _place(row, "_true"),
        "region": _region(row, size),
        "error": None if error is None or pd.isna(error) else percent(error),
    }


def _captured(mark: LampMark, size: float) -> dict[str, Any]:
    return {
        "target": mark.name,
        "class": "captured",
        "label": "on in the photographs",
        "colour": OTHER_COLOUR,
        "found": mark.place.tolist(),
        "truth": None,
        "region": None if mark.covariance is None else _axes(mark.covariance, size),
        "told": mark.told,
    }


def _other(one: ToldAlternative) -> dict[str, Any]:
    places = [light.position.tolist() for light in one.lights if not light.distant]
    return {"places": places, "told": one.told, "ruled_out": one.ruled_out}


def _place(row: Mapping[str, Any], suffix: str) -> list[float] | None:
    place = [float(row[axis + suffix]) for axis in "xyz"]
    return place if all(map(math.isfinite, place)) else None


def _region(row: Mapping[str, Any], size: float) -> list[list[float]] | None:
    """The half-axes of the ellipsoid that holds the light in 95 % of the cases; None where nothing is said of it."""
    xx, xy, xz, yy, yz, zz = (float(row.get(name, math.nan)) for name in VARIANCES)
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.isnan(matrix).any():
        return None
    return _axes(matrix, size)


def _axes(matrix: npt.NDArray, size: float) -> list[list[float]]:
    lengths, axes = calibration.half_axes(matrix, LONGEST * size)
    return (axes * lengths).T.tolist()
