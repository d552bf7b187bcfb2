"""What a fit did from its start to its answer: its lights and their errors, step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from rgspipe.evaluation.convergence import light_suffix, light_suffixes
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.scene import Light, LightRig
from rgspipe.scene.lights.light import AXIS_COLUMNS

#: At most so many steps of a fit are looked at: the first ones densely, as most happens there.
MOST_STEPS = 150


@dataclass(frozen=True)
class CourseStep:
    """A step of a fit: its number, seconds since the fit began, the method's own loss, and the lights."""

    step: int
    seconds: float
    loss: float
    rig: LightRig


def course_of(curve: pd.DataFrame, found: LightRig, most: int = MOST_STEPS) -> list[CourseStep]:
    """The steps of a fit that are looked at, the first and the last among them.

    Args:
        curve: convergence.csv of a fit: a row a step with step, seconds, loss, and the lights' `columns`; names of the
            second light's columns end in _1, and so on.
        found: the lights at the end, for what the table leaves out. Steps with other lights than these, in number or
            type, are passed over.
        most: of all steps.
    """
    rows = curve.to_dict("records")
    rigs = [_rig(row, found) for row in rows]
    whole = [
        CourseStep(int(row["step"]), float(row["seconds"]), float(row["loss"]), rig)
        for row, rig in zip(rows, rigs, strict=True)
        if rig is not None
    ]
    return [whole[index] for index in _spread(len(whole), most)]


def course_table(steps: Sequence[CourseStep], truth: LightRig, scene_size: float) -> pd.DataFrame:
    """One row a step: step, seconds, loss, position_error and intensity_error (fractions), and x … z of each light.

    Position errors are the largest of the lights, over the scene's size; NaN without truth or size.
    """
    rows = []
    for one in steps:
        errors = rig_errors(one.rig, truth, scene_size if math.isfinite(scene_size) else 1.0) if truth else None
        position = errors.position if errors is not None and math.isfinite(scene_size) else math.nan
        row = {"step": one.step, "seconds": one.seconds, "loss": one.loss, "position_error": position}
        row["intensity_error"] = math.nan if errors is None else errors.intensity
        rows.append(row | _places(one.rig))
    return pd.DataFrame(rows)


def course_summary(courses: pd.DataFrame, limit: float) -> pd.DataFrame:
    """One row a target and method: where it started and ended, in how many steps and seconds.

    `seconds_to_limit` is when the position error came below `limit` for good; NaN where it never did.

    Args:
        courses: rows of `course_table` with target, occlusion and method beside them.
    """
    rows = []
    for (target, method), course in courses.groupby(["target", "method"], sort=False):
        first, last = course.iloc[0], course.iloc[-1]
        rows.append(
            {"target": target, "occlusion": first["occlusion"], "method": method, "steps": int(last["step"])}
            | {f"{name}_start": first[name] for name in ("position_error", "intensity_error", "image_error")}
            | {f"{name}_end": last[name] for name in ("position_error", "intensity_error", "image_error")}
            | {"seconds": last["seconds"], "seconds_to_limit": _settled(course, limit)}
        )
    return pd.DataFrame(rows)


def _settled(course: pd.DataFrame, limit: float) -> float:
    """Seconds of the first step from which on the position error stays at or below the limit."""
    above = np.flatnonzero(~(course["position_error"].to_numpy(dtype=float) <= limit))
    first = int(above[-1]) + 1 if len(above) else 0
    return float(course["seconds"].iloc[first]) if first < len(course) else math.nan


def _spread(count: int, most: int) -> list[int]:
    """Up to `most` indices below `count`: half of them evenly spread, half denser towards the first."""
    if count <= most:
        return list(range(count))
    even = np.linspace(0, count - 1, most // 2)
    dense = np.geomspace(1, count, most - len(even)) - 1
    return sorted(set(np.concatenate([even, dense]).round().astype(int).tolist()))


def _rig(row: dict, found: LightRig) -> LightRig | None:
    """The lights of a row; None where they are others than those that were found."""
    present = [suffix for suffix in light_suffixes(row) if math.isfinite(row[f"x{suffix}"])]
    if not found or len(present) != len(found):
        return None
    lights = [_light(row, suffix, light) for suffix, light in zip(present, found, strict=True)]
    return None if None in lights else tuple(lights)


def _light(row: dict, suffix: str, found: Light) -> Light | None:
    """The light of a row; None where there is none, or one of another kind than `found`."""
    values = {name: float(row.get(name + suffix, math.nan)) for name in (*found.columns(), *AXIS_COLUMNS)}
    has_axis = all(math.isfinite(values[name]) for name in AXIS_COLUMNS)
    return found.with_columns(values) if has_axis == (found.axis is not None) else None


def _places(rig: LightRig) -> dict[str, float]:
    return {
        name + light_suffix(index): value
        for index, light in enumerate(rig)
        for name, value in zip("xyz", light.position.tolist(), strict=True)
    }
