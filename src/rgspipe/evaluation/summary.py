"""From the table of targets to a row for each method, number of views and class."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from rgspipe.evaluation import metrics
from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.shapes import shape_errors

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
        "median_shape_error": _median(shape_errors(group)),
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
