"""How much surface each surfel stands for."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, clip_ramps
from rgspipe.renderer.point_sets import point_set
from rgspipe.renderer.rays import normalised_weights

#: Rays start this many layers above the surface that they measure.
LIFT_LAYERS = 0.5

#: Rays cast at once: so few that their hits stay in the processor's cache.
RAYS_AT_ONCE = 16_384


def surfel_areas(bvh: SurfelBvh, *, samples: int = 32, seed: int = 0) -> Tensor:
    """(N,) float32 areas A_j = ∫ w_j(x) dx over the surface, scene units².

    Points are drawn from every surfel's own footprint, so their density over the surface is known from
    the surfels that overlap there; each point shares itself out by the coverage's weights w_j and counts
    for the inverse of the density. The sum over j is the area of the visible surface.

    Args:
        samples: points a surfel, placed like the seeds of a sunflower.
    """
    count, generator = len(bvh.surfels), torch.Generator().manual_seed(seed)
    areas = torch.zeros(count, device=bvh.device)
    for block in torch.arange(count).split(max(1, RAYS_AT_ONCE // samples)):
        _add_points(areas, bvh, block.to(bvh.device), samples, generator)
    return areas


def _add_points(areas: Tensor, bvh: SurfelBvh, block: Tensor, samples: int, generator: torch.Generator) -> None:
    """Add what the points of the surfels `block` (B,) stand for to the areas of those that they lie on."""
    surfels, coverage = bvh.surfels, bvh.coverage
    frames, opacities = surfels.frames[block], surfels.opacities[block].float()[:, None]
    local = _normal_points(len(block), samples, generator).to(bvh.device)
    in_plane = torch.einsum("nsa,nac->nsc", (local * surfels.scales[block, None].float()).to(frames), frames[:, :2])
    ramps = clip_ramps(surfels)[block].float()[:, None]
    heights = ramps[..., 0] - ramps[..., 1] * local[..., :1] - ramps[..., 2] * local[..., 1:]
    own_share = heights.clamp(0.0, 1.0).prod(dim=-1)
    # Where a surfel is too faint to be met it adds nothing to the density, so it may place no points there either.
    own_alpha = opacities * (-0.5 * local.square().sum(dim=-1)).exp() * own_share
    own_share = torch.where(own_alpha > coverage.minimum_alpha, own_share, torch.zeros_like(own_share)).reshape(-1)
    down = -frames[:, None, 2].expand_as(in_plane)
    origins = surfels.centers[block, None] + in_plane - LIFT_LAYERS * coverage.layer_thickness * down
    hits = composite(bvh, origins.reshape(-1, 3), down.reshape(-1, 3), nearest=0.0)
    valid = hits.indices >= 0
    index = hits.indices.clamp(min=0).long()
    first_layer = valid & (hits.depths <= hits.depths[:, :1] + coverage.layer_thickness)
    footprint = (surfels.opacities * 2.0 * math.pi * surfels.scales.prod(dim=1)).float()
    per_hit = torch.where(first_layer, samples * hits.alphas / footprint[index], torch.zeros_like(hits.alphas))
    density = per_hit.sum(dim=1)
    own_share = torch.where(density > 0, own_share / density.clamp(min=1e-30), torch.zeros_like(density))
    shares = torch.where(first_layer, normalised_weights(hits), torch.zeros_like(hits.weights)) * own_share[:, None]
    areas.index_add_(0, index.reshape(-1), shares.reshape(-1))


def _normal_points(surfels: int, samples: int, generator: torch.Generator) -> Tensor:
    """(surfels, samples, 2) float32 points of the standard normal distribution (Box and Muller 1958)."""
    u = point_set("golden", surfels, samples, generator)
    radius, angle = (-2.0 * (1.0 - u[..., 0]).log()).sqrt(), 2.0 * math.pi * u[..., 1]
    return torch.stack([radius * angle.cos(), radius * angle.sin()], dim=-1).float()
