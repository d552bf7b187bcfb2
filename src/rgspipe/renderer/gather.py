"""The gather operator: which surfels each surfel sees, as shares of its hemisphere."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.progress import progress_bar
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.reciprocity import Rows, reciprocal_rows
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.point_sets import PointSet, cosine_directions
from rgspipe.renderer.rays import normalised_weights, rows_from_hits
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.view_weights import nearest_hit

#: Rays cast at once: so few that their hits, about 20 MB, are packed before they leave the processor's cache.
RAYS_AT_ONCE = 32_768

#: Gather rays start this many scales above their surfel, clear of its own surface.
LIFT = 0.2


def build_gather(
    bvh: SurfelBvh, rays: int, *, seed: int, areas: Tensor | None = None, points: PointSet = "golden"
) -> SparseOperator:
    """The gather operator F: (F B)_i is the cosine-weighted mean of the radiance that surfel i sees.

    Rows sum to the share of the hemisphere that holds surfaces, at most 1, so there is no 1/r²
    singularity and the light transport I − ρF always has an inverse for albedo below 1.

    Args:
        rays: cosine-distributed hemisphere rays a surfel.
        seed: of the point sets' random parts.
        areas: (N,) surface that each surfel stands for; when given, the estimate is averaged with its
            reciprocal A⁻¹FᵀA, which halves the variance at no ray, and rows keep their sums.
        points: how the rays of a hemisphere are placed.
    """
    surfels, count = bvh.surfels, len(bvh.surfels)
    generator = torch.Generator().manual_seed(seed)
    axes = surfels.frames
    lifted = surfels.centers + LIFT * surfels.scales.prod(dim=1).sqrt()[:, None] * axes[:, 2]
    per_batch = max(1, RAYS_AT_ONCE // rays)
    blocks = [scipy.sparse.csr_matrix((0, count), dtype=np.float32)]
    for start in progress_bar(range(0, count, per_batch), "gather operator", unit="batch"):
        frames = axes[start : start + per_batch].float()
        directions = cosine_directions(frames, rays, generator, points)
        origins = lifted[start : start + per_batch, None].expand_as(directions)
        hits = composite(bvh, origins.reshape(-1, 3), directions.reshape(-1, 3), nearest=nearest_hit(bvh))
        blocks.append(rows_from_hits(hits, normalised_weights(hits), rays, count))
    matrix = scipy.sparse.vstack(blocks, format="csr")
    if areas is not None:
        matrix = reciprocal_mean(matrix, areas)
    return SparseOperator.from_scipy(matrix, bvh.device)


def reciprocal_mean(matrix: scipy.sparse.csr_matrix, areas: Tensor) -> scipy.sparse.csr_matrix:
    """½(F + A⁻¹FᵀA) with the row sums of F (Helmholtz reciprocity, A_i F_ij = A_j F_ji), on the areas' device.

    Args:
        matrix: (N, N) F; areas: (N,), tiny ones count as a thousandth of the median.
    """
    seen = areas[areas > 0]
    least = 1e-3 * float(seen.median()) if seen.numel() else 1.0
    # Transposing sorts the columns of a row, which the rows of the sampled F are not.
    mirrored = matrix.T.tocsr()
    rows = mirrored.T.tocsr()
    found = reciprocal_rows(_rows(rows, areas), _rows(mirrored, areas), areas.float().clamp(min=least))
    starts, columns, values = (part.cpu().numpy() for part in found)
    return scipy.sparse.csr_matrix((values, columns, starts), shape=matrix.shape)


def _rows(matrix: scipy.sparse.csr_matrix, like: Tensor) -> Rows:
    kinds = (matrix.indptr, np.int32), (matrix.indices, np.int32), (matrix.data, np.float32)
    starts, columns, values = (torch.from_numpy(part.astype(kind, copy=False)) for part, kind in kinds)
    return starts.to(like.device), columns.to(like.device), values.to(like.device)
