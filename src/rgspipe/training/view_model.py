"""Images as linear functions of albedo: direct light where pixels look, light that bounces at surfels' centres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.progress import progress_bar
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import PixelDirect
from rgspipe.renderer.sparse import SparseOperator, in_places
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.training.lighting import Lighting
from rgspipe.training.operator_store import OperatorStore


@dataclass(frozen=True)
class LitViewModel:
    """One view under its own light, of P pixels and N surfels.

        image = D (ρ ∘ I) + W (ρ ∘ L)

    with D the direct light of a lamp of π W/sr, I its intensity over π and L the indirect irradiance over π, which
    depends on ρ itself and is an argument below.

    Attributes:
        weights: W.
        direct: (P, N) D, in the same places as W.
        intensity: (3,) I, W/sr over π.
    """

    weights: ViewWeights
    direct: SparseOperator
    intensity: Tensor

    def image(self, albedo: Tensor, indirect: Tensor | None) -> Tensor:
        """(P, 3) radiance of surfels of `albedo` (N, 3) under `indirect` (N, 3); None for no light that bounces."""
        return self.shown(albedo, None if indirect is None else albedo * indirect)

    def shown(self, albedo: Tensor, bounced: Tensor | None) -> Tensor:
        """(P, 3) radiance where surfels of `albedo` (N, 3) reflect `bounced` (N, 3) of the light that bounces."""
        image = self.direct.matrix @ (albedo * self.intensity)
        return image if bounced is None else image + self.weights.operator.matrix @ bounced

    def transposed(self, pixels: Tensor, indirect: Tensor | None) -> Tensor:
        """(N, 3) the transpose of `image` applied to (P, 3)."""
        direct, bounced = self.shown_transposed(pixels)
        return direct if indirect is None else direct + indirect * bounced

    def shown_transposed(self, pixels: Tensor) -> tuple[Tensor, Tensor]:
        """The transpose of `shown` applied to (P, 3): (N, 3) towards the albedo and towards what bounces."""
        return self.intensity * (self.direct.transposed @ pixels), self.weights.operator.transposed @ pixels

    def squared(self, pixel_weights: Tensor, indirect: Tensor | None) -> Tensor:
        """(N, 3) diagonal of the normal equations with weights (P,): Σ_p w_p (D_pj I + W_pj L_j)²."""
        direct, mixed, weighted = products(self.direct, self.weights.operator, pixel_weights)
        total = self.intensity.square() * direct
        if indirect is None:
            return total
        return total + 2.0 * self.intensity * indirect * mixed + indirect.square() * weighted


def products(direct: SparseOperator, weights: SparseOperator, pixel_weights: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Σ_p w_p D_pj², Σ_p w_p D_pj W_pj and Σ_p w_p W_pj² of operators in the same places, w (P,); each (N, 1)."""
    d, w, column = direct.transposed, weights.transposed, pixel_weights[:, None]
    return tuple(_product(left, right) @ column for left, right in ((d, d), (d, w), (w, w)))


def build_view_models(
    bvh: SurfelBvh,
    weights: Sequence[ViewWeights],
    lighting: Lighting,
    at_pixels: bool,
    store: OperatorStore | None = None,
) -> tuple[LitViewModel, ...]:
    """A model of every view under its own light.

    Args:
        at_pixels: whether falloff and shadows are taken where pixels look; otherwise surfels' centres stand for them.
        store: where the operators of direct light are kept; in memory by default.
    """
    models, keep = [], (store or OperatorStore()).keep
    for index, view in enumerate(progress_bar(weights, "direct light", unit="view")):
        if at_pixels:
            direct = PixelDirect(bvh, view).operator(lighting.positions[index], lighting.transmittance[index])
        else:
            direct = _at_centers(view.operator, lighting.irradiance[index])
        models.append(LitViewModel(view, keep(direct), lighting.intensity[index] / torch.pi))
    return tuple(models)


def _at_centers(weights: SparseOperator, irradiance: Tensor) -> SparseOperator:
    return weights.with_values(weights.matrix.values() * irradiance[weights.matrix.col_indices()])


def _product(left: Tensor, right: Tensor) -> Tensor:
    """Element by element, of two matrices with the same places."""
    return in_places(left, left.values() * right.values())
