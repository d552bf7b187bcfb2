"""How like path-traced truth a relit scene is, image by image and over rigs of so many lights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from rgspipe.evaluation.arrays import ArrayLike
from rgspipe.evaluation.image_metrics import hdr_flip, ssim
from rgspipe.evaluation.metrics import psnr

#: What truth is compared by.
MEASURES = ("psnr", "ssim", "flip")


def compared(image: ArrayLike, truth: ArrayLike) -> dict[str, float]:
    """The measures of an image (H, W, 3) of linear radiance beside its truth."""
    values = psnr(image, truth), ssim(image, truth), hdr_flip(image, truth)
    return dict(zip(MEASURES, values, strict=True))


def relight_summary(table: pd.DataFrame) -> pd.DataFrame:
    """One row for each number of lights: rigs, images, means of the measures, the worst PSNR, median milliseconds.

    Args:
        table: a row an image with `rig`, its number of `lights`, `milliseconds` and the measures.
    """
    groups = table.groupby("lights")
    summary = pd.DataFrame({"rigs": groups["rig"].nunique(), "images": groups.size()})
    for name in MEASURES:
        summary[name] = groups[name].mean()
    summary["psnr_min"] = groups["psnr"].min()
    summary["milliseconds"] = groups["milliseconds"].median()
    return summary.reset_index()


def typical_rows(table: pd.DataFrame) -> list[int]:
    """For each number of lights the index of the row with the median PSNR, so that no picture is chosen for its looks.

    Rows without a PSNR count for nothing.
    """
    known = table[np.isfinite(table["psnr"].astype(float))]
    ordered: Sequence[pd.Index] = [group.sort_values("psnr").index for _, group in known.groupby("lights")]
    return [int(index[(len(index) - 1) // 2]) for index in ordered]
