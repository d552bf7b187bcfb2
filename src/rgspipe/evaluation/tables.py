"""From fit results and truth to the table of targets, and which of them are shown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from rgspipe.evaluation import calibration, metrics
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.classes import class_of, class_order
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.evaluation.shapes import shape_kind
from rgspipe.fitting.certainty.regions import inside
from rgspipe.scene import LightRig

#: The upper triangle of the covariance of the position that is shown, scene units².
VARIANCES = ("var_xx", "var_xy", "var_xz", "var_yy", "var_yz", "var_zz")

TARGET_COLUMNS = (
    "target",
    "occlusion",
    "method",
    "views",
    "position_error",
    "intensity_error",
    "axis_error",
    "shape_error",
    "shape_kind",
    "psnr",
    "seconds",
    "success",
    "lights_found",
    "lights_true",
    "count_right",
    "types_right",
    "position_sd",
    "noise_sd",
    "noise_allows",
    "inside_95",
    "x",
    "y",
    "z",
    "r",
    "g",
    "b",
    "x_true",
    "y_true",
    "z_true",
    "r_true",
    "g_true",
    "b_true",
    *VARIANCES,
    "result",
    "reason",
)


def target_table(
    results: pd.DataFrame,
    estimates: Mapping[str, LightRig],
    truths: Mapping[str, LightRig],
    scene_size: float,
    success_limit: float = metrics.SUCCESS_LIMIT,
    covariances: Mapping[str, Sequence[ArrayLike]] | None = None,
    noise_bounds: Mapping[str, Sequence[ArrayLike]] | None = None,
) -> pd.DataFrame:
    """One row a target: what was fitted, what was true, and the errors.

    Args:
        results: rows of fits, with `target`, `occlusion`, `method`, `views`, `seconds` and where known
            `psnr`, `result`, `reason`.
        estimates: recovered rig per target; a target without one counts as failed.
        truths: true rig per target; targets without one get NaN errors and no verdict.
        scene_size: longest side of the scene's bounding box; NaN if unknown (no position errors then).
        success_limit: position error up to which a target is solved.
        covariances: per target one of each recovered light, the position first; none for targets without.
        noise_bounds: per target the least covariance of each true light that its noise allows, likewise.

    Returns:
        A table with `TARGET_COLUMNS`. `success` is True, False or missing; a rig with lights too many
        or too few is never a success, and has no right types: `types_right` is whether every true light is matched
        by one of its own kind, and none is left over. `shape_kind` is that of the true lights that have a shape, in
        whose unit `shape_error` is. Positions and intensities are those of the true rig's first light and of the
        estimate matched to it. `position_sd` is the error that the fit expects of itself
        (`calibration.position_sd`), `inside_95` whether the true positions lie inside its 95 % regions; missing
        where that cannot be told or the number of lights is wrong. `noise_sd` is the least error that the target's
        noise allows, and `noise_allows` whether that is within the limit; missing where no noise is known.
    """
    required = ("target", "occlusion", "method", "views", "seconds")
    missing = [name for name in required if name not in results.columns]
    if missing:
        raise ValueError(f"the fit results lack the columns {missing}, found {list(results.columns)}")
    rows = [
        _target_row(
            row,
            estimates.get(row["target"], ()),
            truths.get(row["target"], ()),
            scene_size,
            success_limit,
            (covariances or {}).get(row["target"], ()),
            (noise_bounds or {}).get(row["target"], ()),
        )
        for row in results.to_dict("records")
    ]
    table = pd.DataFrame(rows, columns=list(TARGET_COLUMNS))
    return table.astype(
        {
            "success": "boolean",
            "count_right": "boolean",
            "types_right": "boolean",
            "noise_allows": "boolean",
            "inside_95": "boolean",
            "views": int,
            "lights_found": int,
            "lights_true": "Int64",
        }
    )


def exemplars(targets: pd.DataFrame) -> dict[str, dict[str, str]]:
    """The median and the worst target of each class: {class: {"median": target, "worst": target}}.

    By position error where the truth is known, else by PSNR (the lower, the worse). A class of one
    target has only a median.
    """
    chosen: dict[str, dict[str, str]] = {}
    for name in class_order(targets["occlusion"]):
        group = targets[targets["occlusion"] == name]
        key = group["position_error"] if group["position_error"].notna().any() else -group["psnr"].astype(float)
        ordered = group.loc[key.sort_values(kind="stable", na_position="first").index, "target"].tolist()
        compared = ordered[int(key.isna().sum()) :] or ordered
        chosen[name] = {"median": compared[(len(compared) - 1) // 2]}
        if len(compared) > 1:
            chosen[name]["worst"] = compared[-1]
    return chosen


def _target_row(
    row: dict,
    estimate: LightRig,
    truth: LightRig,
    scene_size: float,
    limit: float,
    covariances: Sequence[ArrayLike],
    bounds: Sequence[ArrayLike],
) -> dict:
    position, intensity, axis, shape, solved = math.nan, math.nan, math.nan, math.nan, None
    pairs: tuple[tuple[int, int], ...] = ()
    if truth:
        known_size = math.isfinite(scene_size)
        errors = rig_errors(estimate, truth, scene_size if known_size else 1.0)
        pairs, intensity, axis, shape = errors.pairs, errors.intensity, errors.axis, errors.shape
        if known_size:
            position = errors.position
            solved = metrics.success(position, limit) and len(estimate) == len(truth)
    shown = estimate[pairs[0][0]] if pairs else (estimate[0] if estimate else None)
    true_light = truth[pairs[0][1]] if pairs else (truth[0] if truth else None)
    size = scene_size if math.isfinite(scene_size) else 1.0
    positions = _positions(estimate, covariances, size)
    noise = calibration.position_sd(_positions(truth, bounds, size), scene_size)
    shown_spread = positions[pairs[0][0] if pairs else 0] if positions else None
    return (
        {name: row[name] for name in ("target", "occlusion", "method", "views", "seconds")}
        | {"occlusion": class_of(row["occlusion"], len(truth))}
        | {"position_error": position, "intensity_error": intensity, "axis_error": axis, "shape_error": shape}
        | {"shape_kind": shape_kind(truth)}
        | {"success": solved, "count_right": len(estimate) == len(truth) if truth else None}
        | {"types_right": _types_right(estimate, truth, pairs)}
        | {"psnr": _number(row.get("psnr")), "result": row.get("result", ""), "reason": row.get("reason", "")}
        | {"lights_found": len(estimate), "lights_true": len(truth) if truth else None}
        | {"position_sd": calibration.position_sd(positions, scene_size)}
        | {"noise_sd": noise, "noise_allows": None if math.isnan(noise) else noise <= limit}
        | {"inside_95": _inside(estimate, truth, positions, pairs, size)}
        | _light_columns(shown, "")
        | _light_columns(true_light, "_true")
        | _variance_columns(shown_spread)
    )


def _positions(rig: LightRig, covariances: Sequence[ArrayLike], size: float) -> list[npt.NDArray]:
    """(3, 3) of where each light stands."""
    pairs = zip(rig, covariances, strict=False)
    return [to_array(light.standing_spread(matrix, size)) for light, matrix in pairs]


def _types_right(estimate: LightRig, truth: LightRig, pairs: Sequence[tuple[int, int]]) -> bool | None:
    """Whether the lights are as many as there are, each of the type of its match; None where the truth is not known."""
    if not truth:
        return None
    return len(estimate) == len(truth) and all(estimate[i].kind == truth[j].kind for i, j in pairs)


def _inside(
    estimate: LightRig,
    truth: LightRig,
    positions: Sequence[npt.NDArray],
    pairs: Sequence[tuple[int, int]],
    size: float,
) -> bool | None:
    """Whether the true positions lie inside the 95 % regions; None where there are none, or too many or few lights."""
    if not truth or len(estimate) != len(truth) or len(positions) != len(estimate):
        return None
    matched = [(estimate[i].standing(size), truth[j].standing(size), positions[i]) for i, j in pairs]
    return inside(*zip(*matched, strict=True))


def _variance_columns(matrix: npt.NDArray | None) -> dict[str, float]:
    values = [math.nan] * len(VARIANCES) if matrix is None else matrix[np.triu_indices(3)].tolist()
    return dict(zip(VARIANCES, values, strict=True))


def _light_columns(light: object, suffix: str) -> dict[str, float]:
    values = [math.nan] * 6
    if light is not None:
        values = [*to_array(light.position).tolist(), *to_array(light.intensity).tolist()]
    return {name + suffix: value for name, value in zip("xyzrgb", values, strict=True)}


def _number(value: object) -> float:
    return math.nan if value is None else float(value)
