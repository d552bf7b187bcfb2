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


def convergence_table(curve: pd.DataFrame, target: dict, truth: LightRig, scene_size: float) -> pd.DataFrame:
    """A fit's steps with the position error of each.

    Args:
        curve: one row a step with `step`, `loss` and where known `seconds` and the lights' `x`, `y`, `z`, then `x_1`
            and so on.
        target: `target`, `occlusion`, `method` and `views` of the fit; repeated in every row.
        truth: true rig, empty if unknown; the error is the largest of the lights after the best matching.
        scene_size: longest side of the scene's bounding box, NaN if unknown.

    Returns:
        A table with `COLUMNS`; what is not known is NaN.
    """
    missing = [name for name in ("step", "loss") if name not in curve.columns]
    if missing:
        raise ValueError(f"a convergence table needs the columns {missing}, found {list(curve.columns)}")
    error = np.full(len(curve), math.nan)
    if truth and {"x", "y", "z"} <= set(curve.columns):
        wanted = np.stack([to_array(light.position) for light in truth])
        error = np.array([_worst_distance(step, wanted) for step in light_positions(curve)]) / scene_size
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


def _worst_distance(found: npt.NDArray[np.float64], wanted: npt.NDArray[np.float64]) -> float:
    pairs = match_positions(found, wanted)
    return max(float(np.linalg.norm(found[i] - wanted[j])) for i, j in pairs)
