"""What rgspipe promises, set against what was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pandas as pd

from rgspipe.evaluation.tables import ALL

#: The promises: dB, seconds, and fractions of the scene's longest side.
TEST_PSNR, TRAINING_SECONDS, FIT_SECONDS = 35.0, 480.0, 5.0
VISIBLE_ERROR, OCCLUDED_ERROR = 0.01, 0.03
#: Targets a class that a promise about medians asks for.
CLASS_SIZE = 20


@dataclass(frozen=True)
class Goal:
    """One promise and its measurement.

    Attributes:
        name: what is measured.
        wanted: the promise in words.
        found: the measurement in words; says so when there is none.
        met: None when nothing was measured.
    """

    name: str
    wanted: str
    found: str
    met: bool | None


def goals(summary: pd.DataFrame, training: dict | None, method: str) -> list[Goal]:
    """The promises with what a summary and the trainer's metrics say of them.

    Args:
        summary: rows of `summary_table`; those of `method` are looked at.
        training: `test_psnr_mean` [dB] and `seconds` of the trained scene, or None.
        method: the fit method that the promises are about.
    """
    training = training or {}
    return [
        _at_least("Held-out views under held-out lights", training.get("test_psnr_mean"), TEST_PSNR),
        _at_most("Training time", training.get("seconds"), TRAINING_SECONDS),
        _median_goal(summary, method, "visible", VISIBLE_ERROR),
        _median_goal(summary, method, "occluded", OCCLUDED_ERROR),
        _more_views(summary, method),
        _fit_time(summary, method),
    ]


def primary_method(summary: pd.DataFrame, preferred: str = "search_lm") -> str:
    """The method that the promises are about: `preferred` if it was run, else the first one; "" without any."""
    methods = list(dict.fromkeys(summary["method"]))
    return preferred if preferred in methods or not methods else str(methods[0])


def percent(fraction: float, digits: int = 2) -> str:
    """A fraction as percent; ∞ for failed fits, — for what is not known."""
    if math.isnan(fraction):
        return "—"
    return "∞" if math.isinf(fraction) else f"{100.0 * fraction:.{digits}f} %"


def _at_least(name: str, value: float | None, limit: float) -> Goal:
    known = value is not None and not math.isnan(value)
    return Goal(
        name, f"≥ {limit:g} dB", f"{value:.2f} dB" if known else "not measured", value >= limit if known else None
    )


def _at_most(name: str, value: float | None, limit: float) -> Goal:
    known = value is not None and not math.isnan(value)
    return Goal(
        name, f"≤ {limit:g} s", f"{value:.0f} s" if known else "not measured", value <= limit if known else None
    )


def _row(summary: pd.DataFrame, method: str, views: int, occlusion: str) -> pd.Series | None:
    chosen = summary[(summary["method"] == method) & (summary["views"] == views) & (summary["occlusion"] == occlusion)]
    return None if chosen.empty or int(chosen["judged"].iloc[0]) == 0 else chosen.iloc[0]


def _median_goal(summary: pd.DataFrame, method: str, occlusion: str, limit: float) -> Goal:
    name = f"{occlusion.capitalize()} light, one view: median position error"
    wanted = f"≤ {percent(limit, 0)} over ≥ {CLASS_SIZE} targets"
    row = _row(summary, method, 1, occlusion)
    if row is None:
        return Goal(name, wanted, "not measured", None)
    interval = f"{percent(row['median_low'])} to {percent(row['median_high'])}"
    found = f"{percent(row['median_position_error'])} ({interval}; {int(row['judged'])} targets)"
    return Goal(name, wanted, found, bool(row["median_position_error"] <= limit and row["judged"] >= CLASS_SIZE))


def _more_views(summary: pd.DataFrame, method: str) -> Goal:
    name, wanted = "Three views against one: median position error", "three views better"
    rows = [_row(summary, method, views, ALL) for views in (1, 3)]
    if rows[0] is None or rows[1] is None:
        return Goal(name, wanted, "not measured", None)
    one, three = (row["median_position_error"] for row in rows)
    return Goal(name, wanted, f"{percent(three)} against {percent(one)}", bool(three < one))


def _fit_time(summary: pd.DataFrame, method: str) -> Goal:
    name, wanted = "Time of a fit after freezing, one view, slowest target", f"≤ {FIT_SECONDS:g} s"
    chosen = summary[(summary["method"] == method) & (summary["views"] == 1) & (summary["occlusion"] == ALL)]
    if chosen.empty or math.isnan(chosen["worst_seconds"].iloc[0]):
        return Goal(name, wanted, "not measured", None)
    worst, median = float(chosen["worst_seconds"].iloc[0]), float(chosen["median_seconds"].iloc[0])
    return Goal(name, wanted, f"{worst:.1f} s (median {median:.1f} s)", worst <= FIT_SECONDS)
