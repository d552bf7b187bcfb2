"""What a study of captures under unknown lamps measures, lamp by lamp, and its medians.

Lamps that a capture did not find count as infinitely far off, and captures that were refused as of a wrong number:
medians of those that were found alone would be the better, the fewer they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

#: How a lamp stood to the photographs, or when it was on; and that nothing is known of any.
IN_SIGHT, HIDDEN, LATER, REFUSED = "in sight", "of none", "later", "refused"

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
    for in_sight in truth["missed_in_sight"]:
        missed = {"where": IN_SIGHT if in_sight else HIDDEN, "position_error": np.inf, "intensity_error": np.inf}
        yield dict(known) | dict.fromkeys(COLUMNS) | shared | missed


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


def failed_row(known: Mapping[str, Any], reason: str, where: str = REFUSED) -> dict[str, Any]:
    """The row of a capture that was refused, or of fits of later lamps that were."""
    return dict(known) | dict.fromkeys(COLUMNS) | {"where": where, "failed": reason}


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Medians and shares by scene, case and where the lamp was; `right` is how often the number of lamps was.

    `count` are lamps, `failed` what was refused; captures that were count as not `right` wherever lamps of their case
    were.
    """
    groups = []
    refused = table[table["where"] == REFUSED].groupby(["scene", "case"]).size()
    for names, part in table.groupby(["scene", "case", "where"], sort=False):
        once = part.drop_duplicates("lighting").dropna(subset=["found"])
        captures = len(once) + int(refused.get(names[:2], 0))
        groups.append(
            dict(zip(("scene", "case", "where"), names, strict=True))
            | {
                "count": int(part["failed"].isna().sum()),
                "failed": int(part["failed"].notna().sum()),
                "position_error": _median(part["position_error"]),
                "worst": part["position_error"].astype(float).max(),
                "intensity_error": _median(part["intensity_error"]),
                "inside_95": part["inside_95"].astype(float).mean(),
                "right": (once["found"] == once["lamps"]).sum() / captures if len(once) else np.nan,
                "albedo": _median(once["albedo"]),
                "psnr": _median(once["psnr"]),
            }
        )
    return pd.DataFrame(groups)


def _median(values: pd.Series) -> float:
    known = values.dropna().astype(float)
    return float(known.median()) if len(known) else np.nan
