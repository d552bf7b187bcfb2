"""Where rays of pixels meet the planes of the surfels that they see."""

from __future__ import annotations

from torch import Tensor, where


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
