"""From fit results and truth to the per-target table and the per-class summary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import linear_sum_assignment

from rgspipe.datasets.classes import LIGHT_CLASSES
from rgspipe.evaluation import calibration, metrics
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.scene import Light, LightRig

#: Occlusion classes in the order in which every table and figure shows them.
CLASSES = (*LIGHT_CLASSES, "mixed", "unknown")
#: The row that holds all targets of a method and view count.
ALL = "all"

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
    "psnr",
    "seconds",
    "success",
    "lights_found",
    "lights_true",
    "count_right",
    "types_right",
    "position_sd",
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
SUMMARY_COLUMNS = (
    "method",
    "views",
    "occlusion",
    "count",
    "with_truth",
    "median_position_error",
    "median_low",
    "median_high",
    "worst_position_error",
    "success_rate",
    "median_intensity_error",
    "median_psnr",
    "median_seconds",
    "worst_seconds",
    "median_axis_error",
    "median_shape_error",
    "count_rate",
    "types_rate",
    "median_position_sd",
    "inside_95",
)


@dataclass(frozen=True)
class RigErrors:
    """How far a recovered rig is from the true one.

    Attributes:
        position: the largest position error of the matched lights, fraction of the scene size.
        intensity: the mean intensity error of the matched lights, a fraction.
        axis: the largest angle between the axes of the true lights that have one and their matches, degrees; infinite
            where a match is of another kind, NaN where no light has an axis.
        shape: the largest error of the first numbers of their shapes and of those that are measured as these (cone
            angles, degrees; exponents; radii; both sides of panels), likewise.
        pairs: (estimate, truth) indices of the matched lights, in the order of the truth.
    """

    position: float
    intensity: float
    axis: float
    shape: float
    pairs: tuple[tuple[int, int], ...]


def match_positions(estimate: npt.ArrayLike, truth: npt.ArrayLike) -> tuple[tuple[int, int], ...]:
    """Pairs (estimate, truth) of positions (K, 3) and (L, 3) with the smallest sum of distances.

    min(K, L) pairs, in the order of the truth. Estimates that are not finite are matched last.
    """
    estimate, truth = np.asarray(estimate, dtype=float), np.asarray(truth, dtype=float)
    if estimate.ndim != 2 or truth.ndim != 2 or estimate.shape[1] != 3 or truth.shape[1] != 3:
        raise ValueError(f"positions must have shapes (K, 3) and (L, 3), got {estimate.shape} and {truth.shape}")
    distance = np.linalg.norm(estimate[:, None] - truth[None], axis=-1)
    finite = distance[np.isfinite(distance)]
    # Larger than any sum of finite distances, so a broken estimate is taken only when nothing else is left.
    far = 1.0 + (float(finite.sum()) if finite.size else 0.0)
    chosen, wanted = linear_sum_assignment(np.where(np.isfinite(distance), distance, far))
    return tuple(sorted(zip(chosen.tolist(), wanted.tolist(), strict=True), key=lambda pair: pair[1]))


def nearest_position(position: npt.ArrayLike, rig: LightRig) -> npt.NDArray | None:
    """(3,) the position of the light of `rig` that is nearest to `position` (3,); None without lights."""
    places = [to_array(light.position) for light in rig]
    return min(places, key=lambda place: float(np.linalg.norm(place - np.asarray(position)))) if places else None


def rig_errors(estimate: LightRig, truth: LightRig, scene_size: float) -> RigErrors:
    """Errors of a recovered rig after the optimal matching of its lights.

    The position error is the worst of the matched lights, so a target counts as solved only when each
    of its lights is; that of a light at infinity is the angle by which it is off [rad].
    Lights too many or too few are not in these numbers: see `target_table`.

    Raises:
        ValueError: the truth has no light.
    """
    if not truth:
        raise ValueError("the true rig has no light")
    if not estimate:
        axis = math.inf if any(light.axis is not None for light in truth) else math.nan
        shape = math.inf if any(light.shape for light in truth) else math.nan
        return RigErrors(math.inf, math.inf, axis, shape, ())
    found, wanted = (np.stack([to_array(light.standing(scene_size)) for light in rig]) for rig in (estimate, truth))
    pairs = match_positions(found, wanted)
    positions = [metrics.position_error(found[i], wanted[j], scene_size) for i, j in pairs]
    intensities = [metrics.intensity_error(estimate[i].intensity, truth[j].intensity) for i, j in pairs]
    axis, shape = _shape_errors([(estimate[i], truth[j]) for i, j in pairs])
    return RigErrors(max(positions), float(np.mean(intensities)), axis, shape, pairs)


def _shape_errors(pairs: Sequence[tuple[Light, Light]]) -> tuple[float, float]:
    """The largest errors of axes [degrees] and of the shapes of matched lights (estimate, truth)."""
    axes, shapes = [], []
    for found, wanted in pairs:
        alike = found.kind == wanted.kind
        if wanted.axis is not None:
            axes.append(metrics.angle_between(found.axis, wanted.axis) if alike else math.inf)
        if wanted.shape:
            shapes.append(_shape_error(found.like(wanted), wanted) if alike else math.inf)
    return max(axes, default=math.nan), max(shapes, default=math.nan)


def _shape_error(found: Light, wanted: Light) -> float:
    """By how much the first number of a shape is off, a spot's cone angle for one, or others like it, in its unit."""
    first, *others = wanted.shape
    numbers = [first, *(one for one in others if one.coordinate is first.coordinate)]
    return max(abs(one.shown(getattr(found, one.name) - getattr(wanted, one.name))) for one in numbers)


def target_table(
    results: pd.DataFrame,
    estimates: Mapping[str, LightRig],
    truths: Mapping[str, LightRig],
    scene_size: float,
    success_limit: float = metrics.SUCCESS_LIMIT,
    covariances: Mapping[str, Sequence[ArrayLike]] | None = None,
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

    Returns:
        A table with `TARGET_COLUMNS`. `success` is True, False or missing; a rig with lights too many
        or too few is never a success, and has no right types: `types_right` is whether every true light is matched
        by one of its own kind, and none is left over. Positions and intensities are those of the true
        rig's first light and of the estimate matched to it. `position_sd` is the error that the fit expects of itself
        (`calibration.position_sd`), `inside_95` whether the true positions lie inside its 95 % regions; missing
        where that cannot be told or the number of lights is wrong.
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
        )
        for row in results.to_dict("records")
    ]
    table = pd.DataFrame(rows, columns=list(TARGET_COLUMNS))
    return table.astype(
        {
            "success": "boolean",
            "count_right": "boolean",
            "types_right": "boolean",
            "inside_95": "boolean",
            "views": int,
            "lights_found": int,
            "lights_true": "Int64",
        }
    )


def summary_table(targets: pd.DataFrame, seed: int, resamples: int = metrics.RESAMPLES) -> pd.DataFrame:
    """One row per method, view count and occlusion class, and one for all classes together.

    Methods and view counts stand in the order in which they first occur.

    `count` is the number of targets, `with_truth` that of targets with a known truth: errors and success
    rate are over those. Position errors of failed fits are inf and count in the median. The interval
    `median_low`…`median_high` is a 95 % bootstrap interval; each row draws from a generator of its
    own, so a row's figures do not depend on which other rows the table has. `resamples=0` leaves the
    interval out.
    """
    rows = []
    for (method, views), group in targets.groupby(["method", "views"], sort=False):
        present = [name for name in class_order(group["occlusion"]) if (group["occlusion"] == name).any()]
        for name in [*present, ALL]:
            chosen = group if name == ALL else group[group["occlusion"] == name]
            rows.append({"method": method, "views": int(views), "occlusion": name} | _summary(chosen, seed, resamples))
    return pd.DataFrame(rows, columns=list(SUMMARY_COLUMNS))


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


def class_order(names: Sequence[str] | pd.Series) -> list[str]:
    """The distinct class names: the known ones in their fixed order, then others by name."""
    found = set(names)
    return [name for name in CLASSES if name in found] + sorted(found - set(CLASSES))


def class_of(listed: str, lights: int) -> str:
    """The class under which a target is shown: one of several lights that belong to none together is "mixed"."""
    return "mixed" if listed == "unknown" and lights > 1 else listed


def _target_row(
    row: dict,
    estimate: LightRig,
    truth: LightRig,
    scene_size: float,
    limit: float,
    covariances: Sequence[ArrayLike],
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
    spreads = zip(estimate, covariances, strict=False)
    positions = [to_array(light.standing_spread(matrix, size)) for light, matrix in spreads]
    shown_spread = positions[pairs[0][0] if pairs else 0] if positions else None
    return (
        {name: row[name] for name in ("target", "occlusion", "method", "views", "seconds")}
        | {"occlusion": class_of(row["occlusion"], len(truth))}
        | {"position_error": position, "intensity_error": intensity, "axis_error": axis, "shape_error": shape}
        | {"success": solved, "count_right": len(estimate) == len(truth) if truth else None}
        | {"types_right": _types_right(estimate, truth, pairs)}
        | {"psnr": _number(row.get("psnr")), "result": row.get("result", ""), "reason": row.get("reason", "")}
        | {"lights_found": len(estimate), "lights_true": len(truth) if truth else None}
        | {"position_sd": calibration.position_sd(positions, scene_size)}
        | {"inside_95": _inside(estimate, truth, positions, pairs, size)}
        | _light_columns(shown, "")
        | _light_columns(true_light, "_true")
        | _variance_columns(shown_spread)
    )


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
    return calibration.inside(*zip(*matched, strict=True))


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


def _summary(group: pd.DataFrame, seed: int, resamples: int) -> dict[str, float]:
    errors = group["position_error"].dropna().to_numpy(dtype=float)
    low, high = math.nan, math.nan
    if resamples > 0:
        low, high = metrics.bootstrap_median(errors, np.random.default_rng(seed), resamples)
    return {
        "count": len(group),
        "with_truth": int(group["position_error"].notna().sum()),
        "median_position_error": _median(group["position_error"]),
        "median_low": low,
        "median_high": high,
        "worst_position_error": float(errors.max()) if errors.size else math.nan,
        "success_rate": _rate(group["success"]) if errors.size else math.nan,
        "median_intensity_error": _median(group["intensity_error"]),
        "median_psnr": _median(group["psnr"]),
        "median_seconds": _median(group["seconds"]),
        "worst_seconds": float(group["seconds"].max()),
        "median_axis_error": _median(group["axis_error"]),
        "median_shape_error": _median(group["shape_error"]),
        "count_rate": _rate(group["count_right"]),
        "types_rate": _rate(group["types_right"]),
        "median_position_sd": _median(group["position_sd"]),
        "inside_95": _rate(group["inside_95"]),
    }


def _rate(verdicts: pd.Series) -> float:
    """Share of True among what is known; NaN where nothing is."""
    known = verdicts.dropna()
    return float(known.astype(float).mean()) if len(known) else math.nan


def _median(values: pd.Series) -> float:
    known = values.dropna().to_numpy(dtype=float)
    return float(np.median(known)) if known.size else math.nan
