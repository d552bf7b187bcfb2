"""What rgspipe has reached before and must not lose, set against what was measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import pandas as pd

from rgspipe.evaluation.classes import ALL
from rgspipe.percent import percent

#: Held-out views of two trainings differ by about so much, dB; a time may be longer by this factor.
PSNR_NOISE, SLOWER = 0.1, 1.05
#: Targets a class that a median is asked of.
CLASS_SIZE = 20
#: Said where nothing was measured.
MISSING = "not measured"


@dataclass(frozen=True)
class Floor:
    """What was reached in a scene with its own targets, on the machine of docs/laboratory/index.md.

    Attributes:
        psnr: held-out views of the frozen scene, mean, dB.
        training_seconds: of train_surfels.
        medians: position errors of search_lm by class and number of views, fractions of the scene's longest side.
        fit_seconds: median of a fit of one view, two fits side by side; None where it was not taken.
    """

    psnr: float
    training_seconds: float
    medians: Mapping[tuple[str, int], float] = field(default_factory=dict)
    fit_seconds: float | None = None


#: By scene, at 128² with 10 000 surfels (20 000 for hotdog and room): docs/laboratory/training.md, places.md.
FLOORS = {
    "cornell": Floor(
        43.6,
        101.0,
        {("visible", 1): 0.0011, ("visible", 3): 0.0009, ("occluded", 1): 0.0040, ("occluded", 3): 0.0018},
        1.2,
    ),
    "corner": Floor(
        44.7, 176.0, {("visible", 1): 0.0014, ("visible", 3): 0.0011, ("occluded", 1): 0.0048, ("occluded", 3): 0.0044}
    ),
    "hotdog": Floor(36.7, 299.0),
    "room": Floor(35.7, 353.0),
    "cornell_glossy": Floor(40.1, 288.0),
}

#: Median position errors by case of experiment=light_kinds: docs/laboratory/kinds_of_lights.md.
KINDS = {
    "visible, 1 view": 0.0011,
    "occluded, 1 view": 0.0025,
    "occluded, 3 views": 0.0017,
    "around the corner, 3 views": 0.0029,
    "spot, cone known, 3 views": 0.0023,
    "spot, cone free, 3 views": 0.0031,
    "two lights, 3 views": 0.0031,
    "1 to 3 lights, number unknown, 3 views": 0.0033,
}


@dataclass(frozen=True)
class Goal:
    """What is wanted, and its measurement.

    Attributes:
        name: what is measured.
        wanted: in words.
        found: the measurement in words; says so when there is none.
        met: None when nothing was measured, or too few targets.
    """

    name: str
    wanted: str
    found: str
    met: bool | None


def goals(
    scene: str, summary: pd.DataFrame, training: Mapping | None, method: str, kinds: pd.DataFrame | None = None
) -> list[Goal]:
    """What is wanted of a scene with what a summary and the trainer's metrics say of it; empty without floors.

    Args:
        scene: its name.
        summary: rows of `summary_table`; those of `method` are looked at.
        training: `test_psnr_mean` [dB] and `seconds` of the trained scene, or None.
        method: the fit method that is asked.
        kinds: rows of the study of kinds of lights, if there is one.
    """
    training, floor = training or {}, FLOORS.get(scene)
    found = [] if kinds is None else _kinds(kinds, method)
    if floor is None:
        return found
    medians = [_median_goal(summary, method, *place, limit) for place, limit in floor.medians.items()]
    return [
        _at_least("Held-out views under held-out lights", training.get("test_psnr_mean"), floor.psnr - PSNR_NOISE),
        _at_most("Training time", training.get("seconds"), floor.training_seconds * SLOWER),
        *medians,
        _more_views(summary, method),
        *([] if floor.fit_seconds is None else [_fit_time(summary, method, floor.fit_seconds * SLOWER)]),
        *found,
    ]


def primary_method(summary: pd.DataFrame, preferred: str = "search_lm") -> str:
    """The method that the goals are about: `preferred` if it was run, else the first one; "" without any."""
    methods = list(dict.fromkeys(summary["method"]))
    return preferred if preferred in methods or not methods else str(methods[0])


def at_least(limit: float) -> str:
    """A bound on PSNR in words."""
    return f"≥ {limit:.1f} dB"


def at_most(limit: float) -> str:
    """A bound on time in words."""
    return f"≤ {limit:.0f} s" if limit >= 10.0 else f"≤ {limit:.1f} s"


def _at_least(name: str, value: float | None, limit: float) -> Goal:
    if value is None or math.isnan(value):
        return Goal(name, at_least(limit), MISSING, None)
    return Goal(name, at_least(limit), f"{value:.2f} dB", value >= limit)


def _at_most(name: str, value: float | None, limit: float) -> Goal:
    if value is None or math.isnan(value):
        return Goal(name, at_most(limit), MISSING, None)
    return Goal(name, at_most(limit), f"{value:.0f} s", value <= limit)


def _row(summary: pd.DataFrame, method: str, views: int, occlusion: str) -> pd.Series | None:
    chosen = summary[(summary["method"] == method) & (summary["views"] == views) & (summary["occlusion"] == occlusion)]
    return None if chosen.empty or int(chosen["with_truth"].iloc[0]) == 0 else chosen.iloc[0]


def _median_goal(summary: pd.DataFrame, method: str, occlusion: str, views: int, limit: float) -> Goal:
    name = f"{occlusion.capitalize()} light, {'one view' if views == 1 else f'{views} views'}: median position error"
    row = _row(summary, method, views, occlusion)
    if row is None:
        return _no_worse(name, None, limit)
    middle, low, high = (float(row[key]) for key in ("median_position_error", "median_low", "median_high"))
    return _no_worse(name, (middle, low, high, int(row["with_truth"])), limit)


def _kinds(table: pd.DataFrame, method: str) -> list[Goal]:
    """The study's cases, all classes together."""
    found = []
    for case, limit in KINDS.items():
        rows = table[(table["case"] == case) & (table["method"] == method) & (table["occlusion"] == ALL)]
        if len(rows):
            middle, low, high, compared = rows.iloc[0][["position", "position_low", "position_high", "with_truth"]]
            median = float(middle), float(low), float(high), int(compared)
            found.append(_no_worse(f"Kinds of lights, {case}: median position error", median, limit))
    return found


def _no_worse(name: str, median: tuple[float, float, float, int] | None, limit: float) -> Goal:
    """A median with its interval and number of targets: no worse than `limit` by more than its interval."""
    wanted = f"≤ {percent(limit)} within its interval, over ≥ {CLASS_SIZE} targets"
    if median is None:
        return Goal(name, wanted, MISSING, None)
    middle, low, high, targets = median
    found = f"{percent(middle)} ({percent(low)} to {percent(high)}; {targets} targets)"
    reached = (middle if math.isnan(low) else low) <= limit
    return Goal(name, wanted, found, bool(reached) if targets >= CLASS_SIZE else None)


def _more_views(summary: pd.DataFrame, method: str) -> Goal:
    name, wanted = "Three views against one: median position error", "three views better"
    rows = [_row(summary, method, views, ALL) for views in (1, 3)]
    if rows[0] is None or rows[1] is None:
        return Goal(name, wanted, MISSING, None)
    one, three = (row["median_position_error"] for row in rows)
    told = min(row["with_truth"] for row in rows) >= CLASS_SIZE
    return Goal(name, wanted, f"{percent(three)} against {percent(one)}", bool(three < one) if told else None)


def _fit_time(summary: pd.DataFrame, method: str, limit: float) -> Goal:
    name = "Time of a fit after freezing, one view, median"
    row = _row(summary, method, 1, ALL)
    if row is None or math.isnan(row["median_seconds"]):
        return Goal(name, at_most(limit), MISSING, None)
    median, worst = float(row["median_seconds"]), float(row["worst_seconds"])
    return Goal(name, at_most(limit), f"{median:.1f} s (slowest {worst:.1f} s)", median <= limit)
