"""What bad captures cost: one table over scenes and cases."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
import yaml

from rgspipe.errors import InputError
from rgspipe.evaluation.held_out import QUALITY
from rgspipe.evaluation.tables import ALL, class_order

#: The case without errors, and the row of surfels made from the truth.
CLEAN, TRUTH = "clean", "true surfels"

#: Where the keys of a case belong.
SECTION = "capture"


def parse_case(text: str) -> dict[str, Any]:
    """The configuration changes of a case: "depth_noise=0.01 views=25" are two keys of capture.*, "clean" is none.

    Raises:
        InputError: it is neither.
    """
    changes: dict[str, Any] = {}
    for part in [] if text.strip() == CLEAN else text.split():
        key, equals, value = part.partition("=")
        if not equals or not key or not value:
            raise _unclear(text)
        changes[f"{SECTION}.{key.removeprefix(SECTION + '.')}"] = yaml.safe_load(value)
    if not changes and text.strip() != CLEAN:
        raise _unclear(text)
    return changes


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


def _unclear(text: str) -> InputError:
    return InputError(
        "study.cases",
        expected=f"{CLEAN}, or key=value of {SECTION}.*, several joined by spaces",
        found=repr(text),
        remedy='Write it like "depth_noise=0.01" or "depth_noise=0.01 normals=false".',
    )
