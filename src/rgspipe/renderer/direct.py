"""Direct irradiance from point lights, with exact derivatives towards the light's position."""

from __future__ import annotations

from torch import Tensor

from rgspipe.renderer.kernels.irradiance import point_irradiance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh


def unit_irradiance(
    bvh: SurfelBvh, positions: Tensor, shadows: bool = True, at: Tensor | None = None
) -> tuple[Tensor, Tensor]:
    """Irradiance on N surfels from unit point lights, and its derivative.

        E = T · max(0, n·d) / (|d|⁴ + ε⁴)^{3/4},   d = position − centre,   ε the surfel's scale

    The fourth powers keep the inverse square law where it holds: its relative error is ¾(ε/|d|)⁴.

    Args:
        positions: (L, 3), scene units, or places (L, 4), of which those at infinity give E = T · max(0, n·d) with d the
            direction towards them (`kernels.places`); float64 keeps its digits far from the origin.
        shadows: whether surfels stand in the light's way (T); without, their hierarchy is not touched.
        at: (N,) int64 surfels that are looked at; all if None.

    Returns:
        E (L, N) and dE/dposition (L, N, 3), float32, per W/sr.
    """
    return point_irradiance(bvh, positions, shadows, at)
