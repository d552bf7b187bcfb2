"""Where rays meet the planes of the surfels that they see."""

from __future__ import annotations

from torch import Tensor, where

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rays import SURFACE_SHARE


def on_planes(origin: Tensor, directions: Tensor, centers: Tensor, normals: Tensor, reach: Tensor) -> Tensor:
    """(E, 3) where rays meet the surfels' planes, held within `reach` of their centres; the centres if they graze.

    Args:
        origin: (3,) or (E, 3).
        directions, centers, normals: (E, 3), directions and normals of unit length.
        reach: (E,) scene units; infinite where the plane is surely met, as away from edges.
    """
    across = (directions * normals).sum(-1, keepdim=True)
    grazing = across.abs() <= 1e-6
    along = ((centers - origin) * normals).sum(-1, keepdim=True) / where(grazing, 1.0, across)
    beside = origin + along * directions - centers
    factor = (reach[:, None] / beside.norm(dim=-1, keepdim=True).clamp(min=1e-30)).clamp(max=1.0)
    return where(grazing, centers, centers + beside * factor)


def surface_ahead(bvh: SurfelBvh, origin: Tensor, direction: Tensor) -> tuple[Tensor, Tensor] | None:
    """(3,) float64 place where a ray meets the front of a surface, and (3,) its normal there; None if it meets none."""
    hits = composite(bvh, origin[None], direction[None])
    if float(hits.transmittance) > 1.0 - SURFACE_SHARE:
        return None
    met = int(hits.indices[0, hits.weights[0].argmax()])
    center, normal = (one[met].double().cpu() for one in (bvh.surfels.centers, bvh.surfels.normals))
    along = ((center - origin) @ normal) / (direction @ normal)
    return origin + along * direction, normal
