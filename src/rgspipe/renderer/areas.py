"""How much surface each surfel stands for."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, clip_ramps
from rgspipe.renderer.rays import normalised_weights

#: Rays start this many layers above the surface that they measure.
LIFT_LAYERS = 0.5


def surfel_areas(bvh: SurfelBvh, *, samples: int = 32, seed: int = 0) -> Tensor:
    """(N,) float32 areas A_j = ∫ w_j(x) dx over the surface, scene units².

    Points are drawn from every surfel's own footprint, so their density over the surface is known from
    the surfels that overlap there; each point shares itself out by the coverage's weights w_j and counts
    for the inverse of the density. The sum over j is the area of the visible surface.

    Args:
        samples: points a surfel; the relative error of one area is about 1/√samples of its neighbours'.
    """
    surfels, generator = bvh.surfels.to(torch.float32), torch.Generator().manual_seed(seed)
    count, frames = len(surfels), surfels.frames
    local = torch.randn((count, samples, 2), generator=generator).to(bvh.device)
    offsets = torch.einsum("nsa,nac->nsc", local * surfels.scales[:, None], frames[:, :2])
    points = bvh.surfels.centers[:, None] + offsets
    ramps = clip_ramps(surfels)[:, None]
    heights = ramps[..., 0] - ramps[..., 1] * local[..., :1] - ramps[..., 2] * local[..., 1:]
    own_share = heights.clamp(0.0, 1.0).prod(dim=-1).reshape(-1)
    lift = LIFT_LAYERS * bvh.coverage.layer_thickness
    down = -frames[:, None, 2].expand_as(points)
    hits = composite(bvh, (points - lift * down).reshape(-1, 3), down.reshape(-1, 3), nearest=0.0)
    valid = hits.indices >= 0
    index = hits.indices.clamp(min=0).long()
    first_layer = valid & (hits.depths <= hits.depths[:, :1] + bvh.coverage.layer_thickness)
    footprint = surfels.opacities * 2.0 * math.pi * surfels.scales.prod(dim=1)
    per_hit = torch.where(first_layer, samples * hits.alphas / footprint[index], torch.zeros_like(hits.alphas))
    density = per_hit.sum(dim=1)
    own_share = torch.where(density > 0, own_share / density.clamp(min=1e-30), torch.zeros_like(density))
    shares = torch.where(valid, normalised_weights(hits), torch.zeros_like(hits.weights)) * own_share[:, None]
    return torch.zeros(count, device=bvh.device).index_add_(0, index.reshape(-1), shares.reshape(-1))
