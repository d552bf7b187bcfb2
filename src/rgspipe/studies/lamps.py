"""What a study of captures under unknown lamps measures, lamp by lamp, and its medians."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

#: How a lamp stood to the photographs, or when it was on.
IN_SIGHT, HIDDEN, LATER = "in sight", "of none", "later"

#: Columns of a row.
COLUMNS = ("position_error", "stated", "intensity_error", "inside_95", "found", "lamps", "albedo", "psnr", "failed")


def lamp_rows(known: Mapping[str, Any], metrics: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Rows of the lamps that were on while a room was photographed, by metrics.json of its capture."""
    truth, lamps = metrics["truth"], metrics["lamps"]
    shared = {"found": lamps["number"], "lamps": truth["lamps"], "psnr": metrics.get("test_psnr_mean")}
    shared |= {"albedo": (metrics.get("albedo") or {}).get("relative_l1")}
    for index, error in enumerate(truth["position_error"]):
        yield (
            dict(known)
            | dict.fromkeys(COLUMNS)
            | shared
            | {
                "where": IN_SIGHT if truth["in_sight"][index] else HIDDEN,
                "position_error": error,
                "stated": truth["stated"][index],
                "intensity_error": abs(truth["intensity_ratio"][index] - 1.0),
                "inside_95": truth["inside_95"][index],
            }
        )


def later_rows(known: Mapping[str, Any], fits: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows of lamps that were switched on later, by metrics.csv of an evaluation."""
    for fit in fits.to_dict("records"):
        yield (
            dict(known)
            | dict.fromkeys(COLUMNS)
            | {
                "where": f"{LATER}, {fit['occlusion']}",
                "position_error": fit["position_error"],
                "stated": fit.get("position_sd"),
                "intensity_error": fit["intensity_error"],
                "inside_95": fit.get("inside_95"),
            }
        )


def failed_row(known: Mapping[str, Any], reason: str) -> dict[str, Any]:
    """The row of a capture that was refused."""
    return dict(known) | dict.fromkeys(COLUMNS) | {"where": "", "failed": reason}


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Medians and shares by scene, case and where the lamp was; `right` is how often the number of lamps was."""
    groups = []
    for names, part in table[table["failed"].isna()].groupby(["scene", "case", "where"], sort=False):
        once = part.drop_duplicates("lighting").dropna(subset=["found"])
        groups.append(
            dict(zip(("scene", "case", "where"), names, strict=True))
            | {
                "count": len(part),
                "position_error": part["position_error"].median(),
                "worst": part["position_error"].max(),
                "intensity_error": part["intensity_error"].median(),
                "inside_95": part["inside_95"].astype(float).mean(),
                "right": (once["found"] == once["lamps"]).mean() if len(once) else np.nan,
                "albedo": once["albedo"].astype(float).median() if len(once) else np.nan,
                "psnr": once["psnr"].astype(float).median() if len(once) else np.nan,
            }
        )
    return pd.DataFrame(groups)
