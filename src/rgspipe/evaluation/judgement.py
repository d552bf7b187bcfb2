"""A frozen scene against held-out views, as a fit would see it: every measure, and where the error sits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.evaluation.ceiling import transmittance_image
from rgspipe.evaluation.error_split import pixel_kinds, split_error
from rgspipe.evaluation.held_out import QUALITY, albedo_of_views, held_out_summary, quality_row, view_table
from rgspipe.evaluation.images import Bytes, comparison_strip
from rgspipe.progress import progress_bar
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.training.gloss import GlossScene, render_gloss
from rgspipe.training.lighting import trace_lighting
from rgspipe.training.view_model import build_view_models

#: Where direct light is evaluated: where pixels look, as in a fit's last steps, and at surfels' centres.
PLACES = {"pixels": True, "centres": False}


@dataclass(frozen=True)
class Renders:
    """V held-out views of one frozen scene.

    Attributes:
        views: with their true images and lights.
        images: by the key in `PLACES`, V images (H, W, 3), linear radiance, saturated where the photographs are.
        albedo: V images (H, W, 3).
        count: surfels of the scene.
    """

    views: tuple[View, ...]
    images: dict[str, list[npt.NDArray[np.float32]]]
    albedo: list[npt.NDArray[np.float32]]
    count: int

    def table(self, place: str) -> pd.DataFrame:
        """Every measure of every view; see `view_table`."""
        return view_table(self.images[place], self.views)

    def quality(self) -> pd.DataFrame:
        """One row for each of `PLACES`: `light` and the columns of `QUALITY`; NaN for what is not known."""
        albedo = albedo_of_views(self.albedo, self.views)
        rows = [
            {"light": place, "count": self.count} | quality_row(held_out_summary(self.table(place), *albedo))
            for place in PLACES
        ]
        return pd.DataFrame(rows, columns=["light", *QUALITY]).astype(dict.fromkeys(QUALITY[1:], float))

    def typical(self, place: str) -> Bytes:
        """Truth, render and signed difference of the view whose PSNR is the (lower) median."""
        order = np.argsort(self.table(place)["psnr"].to_numpy())
        index = order[(len(order) - 1) // 2]
        return comparison_strip(self.views[index].image, self.images[place][index])

    def split(self, kinds: Sequence[npt.NDArray[np.int64]]) -> pd.DataFrame:
        """The table of `split_error` for each of `PLACES`, with a column `light`."""
        targets = [view.image for view in self.views]
        parts = [split_error(self.images[place], targets, kinds).table().assign(light=place) for place in PLACES]
        return pd.concat(parts, ignore_index=True)


def render_views(frozen: FrozenScene, views: Sequence[View]) -> Renders:
    """Render `views` under their own lights.

    Raises:
        ValueError: a view has no light.
    """
    dark = [view.name for view in views if view.light is None]
    if dark:
        raise ValueError(f"held-out views must have lights, these have none: {dark[:5]}")
    images: dict[str, list] = {place: [] for place in PLACES}
    albedo = []
    for view in progress_bar(views, "held-out views", unit="view"):
        weights = frozen.view(view.camera)
        albedo.append(weights.image(frozen.surfels.albedo.float()).numpy())
        for place, at_pixels in PLACES.items():
            images[place].append(view.as_photographed(_render(frozen, weights, view, at_pixels)).numpy())
    return Renders(tuple(views), images, albedo, len(frozen.surfels))


def _render(frozen: FrozenScene, weights: ViewWeights, view: View, at_pixels: bool) -> Tensor:
    """(H, W, 3) under the view's own light."""
    if frozen.gloss is None:
        return frozen.render(weights, view.light, sharp=at_pixels)
    operators, lighting = frozen.gloss.operators, trace_lighting(frozen.bvh, [view])
    models = build_view_models(frozen.bvh, [weights], lighting, at_pixels)
    surfels = frozen.gloss.surfels
    scene = GlossScene(surfels, models, lighting, lambda chosen: operators, frozen.transport, at_pixels)
    return render_gloss(scene, surfels).renders[0].reshape(view.camera.height, view.camera.width, 3)


def kinds_of_views(truth: FrozenScene, views: Sequence[View]) -> list[npt.NDArray[np.int64]] | None:
    """`pixel_kinds` of every view, shadows as the true surfels cast them; None where views lack passes."""
    if any(view.depth is None or view.normal is None or bool(view.depth.isnan().any()) for view in views):
        return None
    found = []
    for view in views:
        passing = transmittance_image(truth.bvh, truth.view(view.camera, supersampling=1), view.light.position)
        found.append(pixel_kinds(view, passing, truth.size))
    return found
