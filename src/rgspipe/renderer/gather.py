"""The gather operator: which surfels each surfel sees, as shares of its hemisphere."""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.progress import track
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rays import normalised_weights, rows_from_hits
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.view_weights import nearest_hit

#: Rays cast at once; bounds the memory of their hits to about 110 MB.
RAYS_AT_ONCE = 150_000

#: Gather rays start this many scales above their surfel, clear of its own surface.
LIFT = 0.2

#: Generalised golden ratio of two dimensions: the R₂ low-discrepancy sequence (Roberts 2018).
_R2 = 1.32471795724474602596


def cosine_directions(axes: Tensor, rays: int, generator: torch.Generator) -> Tensor:
    """(N, rays, 3) unit directions, cosine-distributed around the normals axes[:, 2] of frames (N, 3, 3).

    One R₂ point set, shifted at random for every surfel, so that neighbours do not share their errors.
    """
    k = torch.arange(rays, dtype=torch.float64) + 0.5
    points = torch.stack([k / rays, (k / _R2) % 1.0], dim=-1)
    shift = torch.rand((len(axes), 1, 2), generator=generator, dtype=torch.float64)
    u = ((points + shift) % 1.0).to(axes.device, axes.dtype)
    radius, angle = u[..., 0].sqrt(), 2.0 * math.pi * u[..., 1]
    height = (1.0 - u[..., 0]).clamp(min=1e-5).sqrt()
    local = torch.stack([radius * angle.cos(), radius * angle.sin(), height], dim=-1)
    return torch.nn.functional.normalize(local @ axes, dim=-1)


def build_gather(bvh: SurfelBvh, rays: int, *, seed: int, areas: Tensor | None = None) -> SparseOperator:
    """The gather operator F: (F B)_i is the cosine-weighted mean of the radiance that surfel i sees.

    Rows sum to the share of the hemisphere that holds surfaces, at most 1, so there is no 1/r²
    singularity and the light transport I − ρF always has an inverse for albedo below 1.

    Args:
        rays: cosine-distributed hemisphere rays a surfel.
        seed: of the random shifts.
        areas: (N,) surface that each surfel stands for; when given, the estimate is averaged with its
            reciprocal A⁻¹FᵀA, which halves the variance at no ray, and rows keep their sums.
    """
    surfels, count = bvh.surfels, len(bvh.surfels)
    generator = torch.Generator().manual_seed(seed)
    axes = surfels.frames.float()
    lifted = surfels.centers + LIFT * surfels.scales.prod(dim=1).sqrt()[:, None] * axes[:, 2]
    per_batch = max(1, RAYS_AT_ONCE // rays)
    blocks = []
    for start in track(range(0, count, per_batch), "gather operator", unit="batch"):
        directions = cosine_directions(axes[start : start + per_batch], rays, generator)
        origins = lifted[start : start + per_batch, None].expand_as(directions)
        hits = composite(bvh, origins.reshape(-1, 3), directions.reshape(-1, 3), nearest=nearest_hit(bvh))
        blocks.append(rows_from_hits(hits, normalised_weights(hits), rays, count))
    matrix = scipy.sparse.vstack(blocks, format="csr")
    if areas is not None:
        matrix = reciprocal_mean(matrix, areas.double().cpu().numpy())
    return SparseOperator.from_scipy(matrix, bvh.device)


def reciprocal_mean(matrix: scipy.sparse.csr_matrix, areas: np.ndarray) -> scipy.sparse.csr_matrix:
    """½(F + A⁻¹FᵀA) with the row sums of F (Helmholtz reciprocity, A_i F_ij = A_j F_ji)."""
    seen = areas[areas > 0]
    areas = np.maximum(areas, 1e-3 * np.median(seen) if seen.size else 1.0)
    mirrored = scipy.sparse.diags(1.0 / areas) @ matrix.T @ scipy.sparse.diags(areas)
    mean = (matrix + mirrored) * 0.5
    wanted, found = np.asarray(matrix.sum(axis=1)).ravel(), np.asarray(mean.sum(axis=1)).ravel()
    return (scipy.sparse.diags(wanted / np.maximum(found, 1e-12)) @ mean).tocsr().astype(np.float32)
