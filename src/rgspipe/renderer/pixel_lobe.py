"""Highlights of a light where pixels look: within a surfel a lobe changes more than falloff and cosine do."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.renderer.glossy import mirrored
from rgspipe.renderer.kernels.pixel_light import REACH
from rgspipe.renderer.looked_at import on_planes
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels


def only_columns(operator: SparseOperator, chosen: Tensor) -> tuple[SparseOperator, Tensor]:
    """(rows, G) `operator` with the columns `chosen` (G,) alone, and which of its entries (E,) are left."""
    matrix = operator.matrix
    slots = torch.full((matrix.shape[1],), -1, dtype=matrix.col_indices().dtype, device=matrix.device)
    slots[chosen] = torch.arange(len(chosen), dtype=slots.dtype, device=slots.device)
    columns = slots[matrix.col_indices()]
    kept = columns >= 0
    before = torch.cat([kept.new_zeros(1, dtype=torch.int64), kept.cumsum(dim=0)])
    rows = before[matrix.crow_indices().long()].to(matrix.crow_indices().dtype)
    parts = (rows, columns[kept], matrix.values()[kept])
    size = (matrix.shape[0], len(chosen))
    return SparseOperator(torch.sparse_csr_tensor(*parts, size=size, check_invariants=False)), kept


def lobe_cosines(
    view: ViewWeights, places: SparseOperator, surfels: Surfels, chosen: Tensor, light: Tensor, at_pixels: bool = True
) -> Tensor:
    """(E,) cos α of the light's mirrored direction and the eye's, for every entry of `places`.

    Args:
        places: (P, G) which of the surfels `chosen` (G,) each pixel of `view` sees.
        light: (3,) position.
        at_pixels: whether it is taken where each pixel looks on the surfel's plane; otherwise at the surfel's centre.
    """
    matrix = places.matrix
    columns = chosen[matrix.col_indices().long()]
    centers, normals = surfels.centers.double()[columns], surfels.normals.double()[columns]
    origin = view.camera.origin.to(centers)
    points = centers
    if at_pixels:
        pixels = torch.arange(matrix.shape[0], device=columns.device)
        rows = torch.repeat_interleave(pixels, matrix.crow_indices().diff().long())
        directions = view.camera.rays(pixels)[1].to(centers)[rows]
        reach = float(REACH) * surfels.scales.double().prod(dim=1).sqrt()[columns]
        reach = torch.where(view.edges[rows], reach, torch.full_like(reach, torch.inf))
        points = on_planes(origin, directions, centers, normals, reach)
    towards = torch.nn.functional.normalize(light.to(centers) - points, dim=-1)
    eye = torch.nn.functional.normalize(origin - points, dim=-1)
    return (towards * mirrored(eye, normals)).sum(-1).to(matrix.dtype)
