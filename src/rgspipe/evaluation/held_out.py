"""Renders of held-out views: every measure of them in one table, and a picture of typical ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rgspipe.datasets.views import View
from rgspipe.evaluation import metrics
from rgspipe.evaluation.albedo import AlbedoErrors, albedo_errors
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.image_metrics import hdr_flip, ssim
from rgspipe.evaluation.images import Bytes, beside, comparison_strip, signed_difference, stack, tone_map

#: Views that `held_out_picture` shows, and pixels between its columns.
SHOWN_VIEWS, COLUMN_GAP = 6, 12

#: Measures of one view, and whether more is better.
MEASURES = {"psnr": True, "psnr_off_edges": True, "ssim": True, "flip": False}

#: The two kinds of surfels that are judged, in words.
SURFELS = {"trained": "trained surfels", "truth": "true surfels"}

#: Columns of a table of quality, one scene a row.
QUALITY = (
    "count",
    "psnr",
    "psnr_median",
    "psnr_min",
    "psnr_off_edges",
    "ssim",
    "flip",
    "albedo_l1",
    "albedo_l1_scaled",
    "albedo_l1_off_edges",
    "albedo_psnr",
)


def view_table(images: Sequence[ArrayLike], views: Sequence[View]) -> pd.DataFrame:
    """One row a view: `name` and the columns of `MEASURES`; NaN where a measure has no meaning or lacks its passes.

    Args:
        images: renders (H, W, 3) of `views`, linear radiance.
    """
    rows = []
    for image, view in zip(images, views, strict=True):
        plain = plain_pixels(view)
        rows.append(
            {
                "name": view.name,
                "psnr": metrics.psnr(image, view.image),
                "psnr_off_edges": math.nan if plain is None else metrics.psnr(image, view.image, plain),
                "ssim": ssim(image, view.image),
                "flip": hdr_flip(image, view.image),
            }
        )
    return pd.DataFrame(rows, columns=["name", *MEASURES])


def albedo_of_views(
    rendered: Sequence[ArrayLike], views: Sequence[View]
) -> tuple[AlbedoErrors | None, AlbedoErrors | None]:
    """Errors of rendered albedo (H, W, 3) on surfaces, and on those away from edges; None without albedo passes.

    The pass holds the albedo at pixels' centres and a render the mean over them, so at edges the two differ even for
    a perfect scene.
    """
    known = [(image, view) for image, view in zip(rendered, views, strict=True) if view.albedo is not None]
    found, truth = [image for image, _ in known], [view.albedo for _, view in known]
    surface = [surface_pixels(view) for _, view in known]
    plain = [_both(mask, plain_pixels(view)) for mask, (_, view) in zip(surface, known, strict=True)]
    return albedo_errors(found, truth, surface), albedo_errors(found, truth, plain)


def held_out_summary(
    table: pd.DataFrame, on_surfaces: AlbedoErrors | None, off_edges: AlbedoErrors | None
) -> dict[str, Any]:
    """What metrics.json says of a `view_table` and the albedo's errors; None for what is not known.

    `test_<measure>_mean`, `_median` and, for the worst view, `_min` or `_max`, of the views that have the measure: a
    black one has no PSNR; `per_view`, a row a view; `albedo` and `albedo_off_edges`.
    """
    found: dict[str, Any] = {"per_view": [_finite(row) for row in table.to_dict("records")]}
    for name, more_is_better in MEASURES.items():
        values = table[name].to_numpy(dtype=float)
        values = values[~np.isnan(values)]
        worst = ("min", np.min) if more_is_better else ("max", np.max)
        for what, measure in (("mean", np.mean), ("median", np.median), worst):
            value = float(measure(values)) if values.size else math.nan
            found[f"test_{name}_{what}"] = value if math.isfinite(value) else None
    for name, errors in (("albedo", on_surfaces), ("albedo_off_edges", off_edges)):
        found[name] = None if errors is None else _finite(errors.summary())
    return found


def quality_row(summary: dict[str, Any]) -> dict[str, Any]:
    """A held-out summary as the columns of `QUALITY` but for `count`: means, where nothing else is said."""
    row = {name: summary[f"test_{name}_mean"] for name in MEASURES}
    row |= {f"psnr_{what}": summary[f"test_psnr_{what}"] for what in ("median", "min")}
    albedo, off_edges = summary["albedo"] or {}, summary["albedo_off_edges"] or {}
    row |= {"albedo_l1": albedo.get("relative_l1"), "albedo_l1_scaled": albedo.get("relative_l1_scaled")}
    return row | {"albedo_psnr": albedo.get("psnr"), "albedo_l1_off_edges": off_edges.get("relative_l1")}


def surface_pixels(view: View) -> npt.NDArray[np.bool_]:
    """(H, W) where the view shows a surface: finite depth, or without depth at least half opaque."""
    return to_array(view.alpha) >= 0.5 if view.depth is None else np.isfinite(to_array(view.depth))


def plain_pixels(view: View) -> npt.NDArray[np.bool_] | None:
    """(H, W) away from silhouettes and creases; None without whole depth and normal passes, or where none is."""
    if view.depth is None or view.normal is None or bool(view.depth.isnan().any()):
        return None
    mask = ~metrics.edge_mask(view.depth, view.normal)
    return mask if mask.any() else None


def held_out_picture(
    views: Sequence[View],
    images: Sequence[ArrayLike],
    psnr: ArrayLike,
    albedo: Sequence[ArrayLike] | None = None,
) -> Bytes:
    """Some views from the worst PSNR to the best, a row each.

    Truth, render and signed difference; with `albedo` and the views' passes also its truth, render and difference.
    Without albedo the rows stand in two columns.
    """
    order = np.argsort(to_array(psnr))
    chosen = order[np.unique(np.linspace(0, len(order) - 1, min(SHOWN_VIEWS, len(order))).round().astype(int))]
    strips = [comparison_strip(views[i].image, images[i]) for i in chosen]
    if albedo is not None and all(views[i].albedo is not None for i in chosen):
        parts = [
            beside([strip, _albedo_strip(views[i], albedo[i])], COLUMN_GAP)
            for strip, i in zip(strips, chosen, strict=True)
        ]
        return stack(parts)
    half = len(strips) // 2
    columns = [strips[:half], strips[half:]] if len(strips) % 2 == 0 else [strips]
    return beside([stack(column) for column in columns], COLUMN_GAP)


def _albedo_strip(view: View, rendered: ArrayLike) -> Bytes:
    """True and rendered albedo and their difference; reflectance 1 is white."""
    return beside([tone_map(view.albedo, 1.0), tone_map(rendered, 1.0), signed_difference(view.albedo, rendered, 1.0)])


def _both(first: npt.NDArray[np.bool_], second: npt.NDArray[np.bool_] | None) -> npt.NDArray[np.bool_]:
    return np.zeros_like(first) if second is None else first & second


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in values.items()}
