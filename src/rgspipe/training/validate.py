"""How well trained surfels render views that training never saw, under lights that it never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.views import View
from rgspipe.evaluation.metrics import edge_mask, psnr
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.surfels import Surfels
from rgspipe.training.lighting import total_irradiance, trace_lighting
from rgspipe.training.trainer import trace_views


@dataclass(frozen=True)
class HeldOut:
    """Renders of held-out views and their PSNR [dB], on all pixels and away from edges (NaN without passes)."""

    names: tuple[str, ...]
    images: tuple[npt.NDArray[np.float32], ...]
    psnr: npt.NDArray[np.float64]
    psnr_off_edges: npt.NDArray[np.float64]

    def summary(self) -> dict[str, Any]:
        """Mean, median and worst, and a row a view; JSON values."""
        rows = zip(self.names, self.psnr, self.psnr_off_edges, strict=True)
        return {
            "test_psnr_mean": float(np.mean(self.psnr)),
            "test_psnr_median": float(np.median(self.psnr)),
            "test_psnr_min": float(np.min(self.psnr)),
            "test_psnr_off_edges_mean": _number(np.mean(self.psnr_off_edges)),
            "per_view": [{"name": name, "psnr": float(a), "psnr_off_edges": _number(b)} for name, a, b in rows],
        }


def render_held_out(
    surfels: Surfels, views: Sequence[View], transport: PatchTransport | None, supersampling: int
) -> HeldOut:
    """Render `views` under their own lights and compare.

    Args:
        transport: light between the surfels; None renders direct light only.
    """
    weights = trace_views(surfels, views, supersampling)
    lighting = trace_lighting(SurfelBvh(surfels), views)
    radiance = total_irradiance(lighting, surfels.albedo, transport) * surfels.albedo
    images = tuple(weight.image(radiance[v]).numpy() for v, weight in enumerate(weights))
    pairs = list(zip(images, views, strict=True))
    return HeldOut(
        tuple(view.name for view in views),
        images,
        np.array([psnr(image, view.image) for image, view in pairs]),
        np.array([_off_edges(image, view) for image, view in pairs]),
    )


def _off_edges(image: npt.NDArray[np.float32], view: View) -> float:
    """PSNR away from edges, which the depth and normal passes show; NaN where either is missing or has gaps."""
    if view.depth is None or view.normal is None or bool(view.depth.isnan().any()):
        return float("nan")
    mask = ~edge_mask(view.depth, view.normal)
    return psnr(image, view.image, mask) if mask.any() else float("nan")


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
