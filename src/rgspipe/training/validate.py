"""How well trained surfels render views that training never saw, under lights that it never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rgspipe.datasets.views import View
from rgspipe.evaluation.held_out import albedo_of_views, held_out_summary, view_table
from rgspipe.evaluation.metrics import psnr
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.surfels import Surfels
from rgspipe.training.lighting import total_irradiance, trace_lighting
from rgspipe.training.trainer import trace_views


@dataclass(frozen=True)
class HeldOut:
    """Renders of held-out views, and what they are compared with.

    Attributes:
        views: V views with their true images.
        images: V renders (H, W, 3), linear radiance.
        albedo: V images (H, W, 3) of the surfels' albedo.
    """

    views: tuple[View, ...]
    images: tuple[npt.NDArray[np.float32], ...]
    albedo: tuple[npt.NDArray[np.float32], ...]

    @cached_property
    def psnr(self) -> npt.NDArray[np.float64]:
        """(V,) PSNR [dB]."""
        return np.array([psnr(image, view.image) for image, view in zip(self.images, self.views, strict=True)])

    @cached_property
    def table(self) -> pd.DataFrame:
        """PSNR, SSIM and FLIP of every view; see `view_table`."""
        return view_table(self.images, self.views)

    @property
    def psnr_off_edges(self) -> npt.NDArray[np.float64]:
        """(V,) PSNR [dB] away from silhouettes and creases; NaN without depth and normal passes."""
        return self.table["psnr_off_edges"].to_numpy()

    def summary(self) -> dict[str, Any]:
        """PSNR, SSIM, FLIP and albedo errors, over all views and for each; JSON values."""
        return held_out_summary(self.table, *albedo_of_views(self.albedo, self.views))


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
    albedo = tuple(weight.image(surfels.albedo.float()).numpy() for weight in weights)
    return HeldOut(tuple(views), images, albedo)
