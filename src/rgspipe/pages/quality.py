"""What a page says of the trained scene beside one made from the truth."""

from __future__ import annotations

from typing import Any

import pandas as pd

from rgspipe.evaluation.classes import ALL, class_order
from rgspipe.evaluation.held_out import SURFELS

#: Rows of the quality table: column, words, factor, unit and digits.
_ROWS = (
    ("psnr", "PSNR of held-out views under held-out lights, mean", 1.0, "dB", 2),
    ("psnr_median", "… median", 1.0, "dB", 2),
    ("psnr_min", "… worst view", 1.0, "dB", 2),
    ("psnr_off_edges", "… mean away from silhouettes and creases", 1.0, "dB", 2),
    ("ssim", "SSIM, mean", 1.0, "", 4),
    ("flip", "HDR-FLIP, mean (0 is equal)", 1.0, "", 4),
    ("albedo_l1", "albedo: relative error on surfaces", 100.0, "%", 2),
    ("albedo_l1_off_edges", "… away from edges", 100.0, "%", 2),
    ("albedo_l1_scaled", "… after one factor a channel", 100.0, "%", 2),
    ("albedo_psnr", "albedo: PSNR", 1.0, "dB", 2),
    ("count", "surfels", 1.0, "", 0),
)


def quality_columns(quality: pd.DataFrame) -> list[str]:
    """Headings of the quality table: which surfels, and where direct light is evaluated."""
    return [f"{SURFELS[row.surfels]}, light at {row.light}" for row in quality.itertuples()]


def quality_rows(quality: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows `{"label", "values"}` of the quality table, as text; measures that nobody has are left out.

    Args:
        quality: rows with `surfels`, `light` and the columns of `held_out.QUALITY`.
    """
    rows = []
    for column, label, factor, unit, digits in _ROWS:
        if quality[column].notna().any():
            values = [_shown(value * factor, unit, digits) for value in quality[column]]
            rows.append({"label": label, "values": values})
    return rows


def compared_lights(summary: pd.DataFrame, true_summary: pd.DataFrame) -> list[dict[str, Any]]:
    """Median position errors with trained and with true surfels by class, and the factor between them.

    Rows of the methods and view counts that both summaries have: `method`, `views`, `occlusion`, `count`, `trained`,
    `truth` and `factor`; the factor is NaN where either is not known or the truth's error is 0.
    """
    keys = ["method", "views", "occlusion"]
    if summary.empty or true_summary.empty:
        return []
    found = summary[[*keys, "count", "median_position_error"]].rename(columns={"median_position_error": "trained"})
    true = true_summary[[*keys, "median_position_error"]].rename(columns={"median_position_error": "truth"})
    merged = found.merge(true, on=keys)
    order = [*class_order([name for name in merged["occlusion"] if name != ALL]), ALL]
    merged = merged.sort_values("occlusion", key=lambda column: column.map(order.index), kind="stable")
    merged = merged.sort_values("views", kind="stable")
    return merged.assign(factor=merged["trained"] / merged["truth"].where(merged["truth"] > 0.0)).to_dict("records")


def _shown(value: float, unit: str, digits: int) -> str:
    return "—" if pd.isna(value) else f"{value:,.{digits}f} {unit}".strip()
