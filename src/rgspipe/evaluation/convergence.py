"""The course of a fit: loss and position error at every step."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from rgspipe.evaluation.arrays import to_array
from rgspipe.scene import LightRig

COLUMNS = ("target", "occlusion", "method", "views", "step", "seconds", "loss", "position_error")


def convergence_table(curve: pd.DataFrame, target: dict, truth: LightRig, scene_size: float) -> pd.DataFrame:
    """A fit's steps with the position error of each.

    Args:
        curve: one row a step with `step`, `loss` and where known `seconds` and the light's `x`, `y`, `z`.
        target: `target`, `occlusion`, `method` and `views` of the fit; repeated in every row.
        truth: true rig, empty if unknown; the error is the distance to its nearest light.
        scene_size: longest side of the scene's bounding box, NaN if unknown.

    Returns:
        A table with `COLUMNS`; what is not known is NaN.
    """
    missing = [name for name in ("step", "loss") if name not in curve.columns]
    if missing:
        raise ValueError(f"a convergence table needs the columns {missing}, found {list(curve.columns)}")
    error = np.full(len(curve), math.nan)
    if truth and {"x", "y", "z"} <= set(curve.columns):
        positions = curve[["x", "y", "z"]].to_numpy(dtype=float)
        wanted = np.stack([to_array(light.position) for light in truth])
        error = np.linalg.norm(positions[:, None] - wanted[None], axis=-1).min(axis=1) / scene_size
    seconds = curve["seconds"].to_numpy(dtype=float) if "seconds" in curve.columns else math.nan
    described = {name: target[name] for name in COLUMNS[:4]}
    measured = {"step": curve["step"], "seconds": seconds, "loss": curve["loss"], "position_error": error}
    return pd.DataFrame(described | measured, columns=COLUMNS, index=curve.index).reset_index(drop=True)
