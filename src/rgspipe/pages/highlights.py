"""The few figures of a scene that stand at the top of its page, and in the table over scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

from rgspipe.evaluation import goals
from rgspipe.evaluation.classes import ALL
from rgspipe.pages.html import decimals
from rgspipe.percent import percent

#: Columns of a quality table that are highlights.
_QUALITY = ("psnr", "psnr_off_edges", "ssim", "flip", "albedo_l1")

#: Every highlight: dB, HDR-FLIP, fractions, counts and seconds; `true_…` with surfels made from the truth.
NAMES = (
    *_QUALITY,
    *(f"true_{name}" for name in _QUALITY),
    "position_error",
    "true_position_error",
    "intensity_error",
    "solved",
    "targets",
    "surfels",
    "training_seconds",
)


def highlights(
    quality: pd.DataFrame | None,
    summary: pd.DataFrame,
    true_summary: pd.DataFrame | None,
    training: Mapping[str, Any] | None,
) -> dict[str, float | None]:
    """Every figure of `NAMES`; None for what is not known. Errors are infinite where more than half of fits failed.

    Args:
        quality: rows of every measure of held-out views with `surfels` and `light`; those with light at pixels count.
        summary: rows of `summary_table`: the row over all classes of the main method with the fewest views counts.
        true_summary: the same with surfels made from the truth.
        training: `test_psnr_mean` [dB], which stands in for quality, `surfels` and `seconds`.
    """
    training = training or {}
    found = dict.fromkeys(NAMES) | _quality(quality, "trained", "") | _quality(quality, "truth", "true_")
    if found["psnr"] is None:
        found |= {"psnr": training.get("test_psnr_mean"), "psnr_off_edges": training.get("test_psnr_off_edges_mean")}
    lights = _lights(summary, goals.primary_method(summary))
    if lights is not None:
        found |= {"position_error": lights["median_position_error"], "targets": lights["count"]}
        found |= {"intensity_error": lights["median_intensity_error"], "solved": lights["success_rate"]}
        true = None if true_summary is None else _lights(true_summary, str(lights["method"]), lights["views"])
        found["true_position_error"] = None if true is None else true["median_position_error"]
    found |= {"surfels": training.get("surfels"), "training_seconds": training.get("seconds")}
    return {name: _plain(value) for name, value in found.items()}


def tiles(found: Mapping[str, float | None]) -> list[dict[str, str]]:
    """The figures at the top of a page: `value`, `label` and a line `beside` it; what is not known is left out."""
    ceiling = "true surfels: {}".format
    candidates = (
        ("psnr", decimals(found["psnr"], 1) + " dB", "PSNR of held-out views", "true_psnr"),
        ("ssim", decimals(found["ssim"], 4), "SSIM (1 is equal)", "true_ssim"),
        ("flip", decimals(found["flip"], 3), "HDR-FLIP (0 is equal)", "true_flip"),
        ("albedo_l1", percent(found["albedo_l1"], 1), "error of albedo", "true_albedo_l1"),
        ("position_error", percent(found["position_error"]), "lights: median position error", "true_position_error"),
    )
    formats = {
        "true_psnr": lambda value: f"{value:.1f} dB",
        "true_ssim": lambda value: f"{value:.4f}",
        "true_flip": lambda value: f"{value:.3f}",
        "true_albedo_l1": lambda value: percent(value, 1),
        "true_position_error": percent,
    }
    shown = []
    for name, value, label, true in candidates:
        if found[name] is not None:
            beside = "" if found[true] is None else ceiling(formats[true](found[true]))
            shown.append({"value": value, "label": label, "beside": beside})
    if found["training_seconds"] is not None:
        surfels = "" if found["surfels"] is None else f"{found['surfels']:,.0f} surfels"
        shown.append({"value": f"{found['training_seconds']:,.0f} s", "label": "training", "beside": surfels})
    return shown


def _quality(quality: pd.DataFrame | None, surfels: str, prefix: str) -> dict[str, Any]:
    if quality is None:
        return {}
    rows = quality[(quality["surfels"] == surfels) & (quality["light"] == "pixels")]
    return {f"{prefix}{name}": rows[name].iloc[0] for name in _QUALITY} if len(rows) else {}


def _lights(summary: pd.DataFrame, method: str, views: int | None = None) -> pd.Series | None:
    """The row over all classes with `views` views, by default the fewest."""
    if summary.empty:
        return None
    rows = summary[(summary["method"] == method) & (summary["occlusion"] == ALL)]
    rows = rows if views is None else rows[rows["views"] == views]
    return rows.sort_values("views", kind="stable").iloc[0] if len(rows) else None


def _plain(value: Any) -> float | None:
    return None if value is None or math.isnan(value) else float(value)
