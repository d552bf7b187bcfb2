"""What bad captures cost: one table over scenes and cases."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.held_out import QUALITY

#: The case in which nothing differs.
CLEAN = "clean"
#: The row of surfels made from the truth.
TRUTH = "true surfels"


def study_row(scene: str, case: str, quality: pd.DataFrame, lights: pd.DataFrame) -> dict[str, Any]:
    """One row of the study.

    Args:
        quality: the quality table of the case's scene; its row with light at pixels counts.
        lights: the summary table of the lights that were recovered in it.

    Returns:
        `scene`, `case`, the columns of `QUALITY`, and of the lights the medians `position_error`, `intensity_error`
        and `solved` (the share within the limit) over all classes, and `position_error_<class>`.
    """
    shown = quality[quality["light"] == "pixels"].iloc[0]
    row = {"scene": scene, "case": case} | {name: shown[name] for name in QUALITY}
    by_class = lights.set_index("occlusion")
    if ALL in by_class.index:
        whole: Mapping[str, Any] = by_class.loc[ALL]
        row |= {"position_error": whole["median_position_error"], "intensity_error": whole["median_intensity_error"]}
        row |= {"solved": whole["success_rate"]}
    for name in class_order([name for name in by_class.index if name != ALL]):
        row[f"position_error_{name}"] = by_class.loc[name, "median_position_error"]
    return row


def with_factors(table: pd.DataFrame) -> pd.DataFrame:
    """The table with `factor`: the median position error over that with true surfels of the same scene."""
    true = table[table["case"] == TRUTH].set_index("scene")["position_error"]
    return table.assign(factor=table["position_error"] / table["scene"].map(true).astype(float))
