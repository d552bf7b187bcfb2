"""The course of a fit, as its convergence.csv says it: lights, loss and position error at every step."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection

import numpy as np
import numpy.typing as npt
import pandas as pd

from rgspipe.evaluation.arrays import to_array
from rgspipe.evaluation.rig_errors import match_positions
from rgspipe.scene import LightRig

COLUMNS = ("target", "occlusion", "method", "views", "step", "seconds", "loss", "position_error")


def convergence_table(
    curve: pd.DataFrame, target: dict, found: LightRig, truth: LightRig, scene_size: float
) -> pd.DataFrame:
    """A fit's steps with the position error of each.

    Args:
        curve: one row a step with `step`, `loss` and where known `seconds` and the lights' `columns`, `x`, `y` and `z`
            at least; names of the second light's end in _1, and so on.
        target: `target`, `occlusion`, `method` and `views` of the fit; repeated in every row.
        found: the lights at the end, which are of the kinds that those of the steps are.
        truth: true rig, empty if unknown; the error is the largest of the lights that have a match, after the best
            matching, that of a sun the angle by which it is off [rad].
        scene_size: longest side of the scene's bounding box, NaN if unknown.

    Returns:
        A table with `COLUMNS`; what is not known is NaN.
    """
    missing = [name for name in ("step", "loss") if name not in curve.columns]
    if missing:
        raise ValueError(f"a convergence table needs the columns {missing}, found {list(curve.columns)}")
    error = np.full(len(curve), math.nan)
    if truth and {"x", "y", "z"} <= set(curve.columns):
        wanted = np.stack([to_array(light.standing(scene_size)) for light in truth])
        error = np.array([_worst_distance(step, wanted) for step in _standing(curve, found, scene_size)]) / scene_size
    seconds = curve["seconds"].to_numpy(dtype=float) if "seconds" in curve.columns else math.nan
    described = {name: target[name] for name in COLUMNS[:4]}
    measured = {"step": curve["step"], "seconds": seconds, "loss": curve["loss"], "position_error": error}
    return pd.DataFrame(described | measured, columns=COLUMNS, index=curve.index).reset_index(drop=True)


def light_suffix(index: int) -> str:
    """What ends the names of a light's columns."""
    return "" if index == 0 else f"_{index}"


def light_suffixes(columns: Collection[str]) -> list[str]:
    """`light_suffix` of each light that the columns have."""
    return list(itertools.takewhile(lambda suffix: f"x{suffix}" in columns, map(light_suffix, itertools.count())))


def light_positions(curve: pd.DataFrame) -> npt.NDArray[np.float64]:
    """(steps, lights, 3) of a fit's steps; NaN where a step has fewer lights than others."""
    lights = [
        curve[[axis + suffix for axis in "xyz"]].to_numpy(dtype=float) for suffix in light_suffixes(curve.columns)
    ]
    return np.stack(lights, axis=1)


def _standing(curve: pd.DataFrame, found: LightRig, size: float) -> npt.NDArray[np.float64]:
    """(steps, lights, 3) `Light.standing` of a fit's steps; NaN where a step has fewer lights than others."""
    places = light_positions(curve)
    for row, standing in zip(curve.to_dict("records"), places, strict=True):
        for index, (light, suffix) in enumerate(zip(found, light_suffixes(row), strict=False)):
            there = light.with_columns({name: row.get(name + suffix, math.nan) for name in light.columns()})
            # One that had another kind on its way, as spheres begin as points, stands where it is.
            if there is not None:
                standing[index] = to_array(there.standing(size))
    return places


def _worst_distance(found: npt.NDArray[np.float64], wanted: npt.NDArray[np.float64]) -> float:
    """Of the lights that have a match; NaN where none has."""
    there = found[np.isfinite(found).all(axis=1)]
    return max(
        (float(np.linalg.norm(there[i] - wanted[j])) for i, j in match_positions(there, wanted)), default=math.nan
    )
