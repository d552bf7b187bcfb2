"""Studies of recovered lights: medians, shares and their intervals over cases, methods, views and classes.

Targets are few, so every figure has a 95 % interval: medians a bootstrap one, shares that of Wilson (1927).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from rgspipe.evaluation import metrics
from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.shapes import common_shape_kind, shape_errors

#: What is studied.
KINDS = ("views", "robustness", "classes", "kinds", "regions", "adam")

#: Why fits end; a column each, with the share of the targets.
STATUSES = ("converged", "undetermined", "ambiguous", "unexplained", "at_bound", "not_enough_light", "max_iterations")

#: Medians: column, and where `tables.target_table` has the values.
MEDIANS = {
    "position": "position_error",
    "intensity": "intensity_error",
    "seconds": "seconds",
    "axis": "axis_error",
    "shape": "shape_error",
}
#: Shares of the targets, likewise.
SHARES = {
    "success": "success",
    "inside_95": "inside_95",
    "right_number": "count_right",
    "right_types": "types_right",
    "noise_allows": "noise_allows",
}

#: Medians of what fits expect of themselves, and of the least that noise allows, likewise.
STATED = {"stated": "position_sd", "noise": "noise_sd"}

#: What names a row.
KEYS = ["scene", "case", "method", "views", "occlusion"]


def case_rows(
    scene: str, case: str, targets: pd.DataFrame, seed: int, resamples: int = metrics.RESAMPLES
) -> pd.DataFrame:
    """What became of the targets of one case: a row for each class, and one for all of them.

    Args:
        targets: rows of `tables.target_table`, of one or more methods and view counts.
        seed: of the resampling; every row draws from a generator of its own.
        resamples: behind the intervals of medians; 0 leaves them out.

    Returns:
        `KEYS`, `count` and `with_truth` (targets, and those with a known truth), and
        - `position` (fraction of the scene), `intensity` (fraction), `seconds`, `axis` (degrees) and `shape`:
          medians, each with `_low` and `_high`;
        - `shape_kind`, the kind of light in whose unit `shape` is; empty, as `shape`, where there are several;
        - `success` (within the limit, with the right number of lights), `inside_95` (the truth lies inside the region
          that the fit states for 95 %), `right_number` (of lights) and `right_types` (their number is right, and each
          is a point or a spot where it should be): shares of those where it is known, with `_low` and `_high`;
        - `stated`: the median of the position errors that fits expect of themselves, and `noise` of the least that
          noise allows; `noise_allows` is the share of those that are within the limit, as above;
        - `silent`, likewise: the share of targets with a truth whose fit says that it converged, misses the limit, and
          states no region that holds the truth: wrong without a word;
        - the share of each of `STATUSES`.
    """
    rows = []
    for (method, views), group in targets.groupby(["method", "views"], sort=False):
        for name in [*class_order(group["occlusion"]), ALL]:
            chosen = group if name == ALL else group[group["occlusion"] == name]
            named = dict(zip(KEYS, (scene, case, method, int(views), name), strict=True))
            rows.append(named | figures(chosen, seed, resamples))
    return pd.DataFrame(rows)


def predicted_errors(targets: pd.DataFrame, advice: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """What fits of few views predict for more of them.

    Args:
        targets: rows of `tables.target_table` of one method and view count.
        advice: by target the rows `views`, `position_sd` of its cameras added in their order.

    Returns:
        `views`, `occlusion` and `predicted`, the median of the predicted position errors over each class and over all;
        the first number of views is that of the fits, with what they state themselves.
    """
    first = targets[["target", "occlusion", "views", "position_sd"]]
    parts = [first[first["target"].isin(list(advice))]]
    for row in first.itertuples():
        if row.target in advice:
            parts.append(advice[row.target].assign(target=row.target, occlusion=row.occlusion))
    known = pd.concat(parts, ignore_index=True)
    known = pd.concat([known, known.assign(occlusion=ALL)]).dropna(subset="position_sd")
    medians = known.groupby(["views", "occlusion"], sort=False)["position_sd"].median()
    return medians.rename("predicted").reset_index()


def wilson_interval(successes: int, count: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927); NaN without targets.

    Unlike a bootstrap it has a width where all targets succeed, or none.
    """
    if count == 0:
        return math.nan, math.nan
    # Slow to import, and the command line imports this module for every report.
    from scipy.stats import binomtest

    interval = binomtest(successes, count).proportion_ci(0.95, method="wilson")
    return float(interval.low), float(interval.high)


def figures(group: pd.DataFrame, seed: int, resamples: int = metrics.RESAMPLES) -> dict[str, float | str | None]:
    """The figures of some targets, see `case_rows`."""
    known = group["position_error"].notna()
    found: dict[str, float | str | None] = {"count": len(group), "with_truth": int(known.sum())}
    group = group.assign(shape_error=shape_errors(group))
    for name, column in MEDIANS.items():
        found |= _median(name, group[column].astype(float), seed, resamples)
    found["shape_kind"] = common_shape_kind(group)
    for name, column in SHARES.items():
        found |= _share(name, group[column])
    for name, column in STATED.items():
        found[name] = float(group[column].median()) if group[column].notna().any() else math.nan
    found |= _share("silent", silent(group)[known])
    return found | {status: float((group["result"] == status).mean()) for status in STATUSES}


def silent(targets: pd.DataFrame) -> pd.Series:
    """Whether each target is wrong without a word, where its truth is known: converged, missed, in no region."""
    return ~_true(targets["success"]) & ~_true(targets["inside_95"]) & (targets["result"] == "converged")


def _median(name: str, values: pd.Series, seed: int, resamples: int) -> dict[str, float]:
    known = values.dropna().to_numpy(dtype=float)
    low, high = math.nan, math.nan
    if resamples > 0:
        low, high = metrics.bootstrap_median(known, np.random.default_rng(seed), resamples)
    middle = float(np.median(known)) if known.size else math.nan
    return {name: middle, f"{name}_low": low, f"{name}_high": high}


def _share(name: str, verdicts: pd.Series) -> dict[str, float]:
    known = verdicts.dropna().astype(bool)
    low, high = wilson_interval(int(known.sum()), len(known))
    return {name: float(known.mean()) if len(known) else math.nan, f"{name}_low": low, f"{name}_high": high}


def _true(verdicts: pd.Series) -> pd.Series:
    """Whether a verdict is known and true."""
    return verdicts.astype("boolean").fillna(False).astype(bool)


def without_repeats(table: pd.DataFrame) -> pd.DataFrame:
    """The table without rows of all classes together where the scene has only one class, which they repeat."""
    alone = table.groupby("scene")["occlusion"].transform(lambda names: names[names != ALL].nunique() == 1)
    return table[~(alone.astype(bool) & (table["occlusion"] == ALL))]


def several(table: pd.DataFrame, columns: Sequence[str]) -> list[str]:
    """Those of the columns in which the rows differ."""
    return [name for name in columns if table[name].nunique() > 1]
