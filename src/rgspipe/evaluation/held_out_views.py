"""How well trained surfels render views that training never saw, under lights that it never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.evaluation.held_out import albedo_of_views, held_out_summary, view_table
from rgspipe.evaluation.metrics import psnr
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.surfels import Surfels
from rgspipe.training.gloss import GlossScene, render_gloss
from rgspipe.training.gloss_light import operators_from
from rgspipe.training.lighting import indirect_irradiance, trace_lighting
from rgspipe.training.materials import trace_views
from rgspipe.training.operator_store import OperatorStore
from rgspipe.training.view_model import build_view_models


@dataclass(frozen=True)
class HeldOut:
    """Renders of held-out views, and what they are compared with.

    Attributes:
        views: V views with their true images.
        images: V renders (H, W, 3), linear radiance, saturated where the photographs are.
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
    surfels: Surfels,
    views: Sequence[View],
    transport: PatchTransport | None,
    supersampling: int,
    at_pixels: bool = True,
    store: OperatorStore | None = None,
    gather: SparseOperator | None = None,
) -> HeldOut:
    """Render `views` under their own lights and compare.

    Args:
        transport: light between the surfels; None renders direct light only.
        at_pixels: whether direct light is taken where pixels look, otherwise at surfels' centres.
        store: where the views' operators are kept; in memory by default.
        gather: (N, N) which surfels each of them sees, with `transport`; surfels with gloss need it.

    Raises:
        ValueError: surfels with gloss, and no gather operator or no transport.
    """
    store, device, given = store or OperatorStore(), surfels.centers.device, views
    views = [view.to(device) for view in given]
    weights = trace_views(surfels, views, supersampling, store)
    bvh, own = SurfelBvh(surfels), surfels.albedo.float()
    lighting = trace_lighting(bvh, views)
    models = build_view_models(bvh, weights, lighting, at_pixels, store.beside())
    if surfels.gloss is not None and len(surfels.gloss.glossy):
        if transport is None or gather is None:
            raise ValueError("surfels with gloss are rendered with all bounces: pass transport and gather")
        operators = operators_from(surfels, gather, transport)
        scene = GlossScene(surfels, models, lighting, operators, transport, at_pixels)
        flat = render_gloss(scene, surfels).renders
    else:
        bounced = [None] * len(views) if transport is None else indirect_irradiance(lighting, own, transport)
        flat = [model.image(own, indirect) for model, indirect in zip(models, bounced, strict=True)]
    images = tuple(_image(view, pixels) for view, pixels in zip(views, flat, strict=True))
    albedo = tuple(weight.image(own).cpu().numpy() for weight in weights)
    return HeldOut(tuple(given), images, albedo)


def _image(view: View, pixels: Tensor) -> npt.NDArray[np.float32]:
    return view.as_photographed(pixels.reshape(view.image.shape)).cpu().numpy()
