"""Slow, plain torch versions of the kernels, in the dtype of their inputs (float64 in tests).

Every ray is tested against every surfel and everything is differentiable by autograd, so these say what
the kernels must compute. The kernels take a hierarchy where these take the surfels; the rest of a
signature is the same.
"""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import GRAZING, OPAQUE
from rgspipe.renderer.kernels.shadow import COPLANAR_COSINE, COPLANAR_OFFSET, RECEIVER_FADE, RECEIVER_SKIP
from rgspipe.scene.surfels import Surfels


def smoothstep(raw: Tensor, low: Tensor | float, high: Tensor | float) -> Tensor:
    """0 below low, 1 above high, 3y² − 2y³ between."""
    y = ((raw - low) / (high - low)).clamp(0.0, 1.0)
    return y * y * (3.0 - 2.0 * y)


def alpha_at(surfels: Surfels, offsets: Tensor) -> Tensor:
    """(R, N) opacity of surfel n at offsets (R, N, 3) from its centre in its plane."""
    frames, softness = surfels.frames, surfels.coverage.clip_softness
    local = torch.einsum("rnc,nac->rna", offsets, frames[:, :2])
    standardised = local / surfels.scales
    alpha = surfels.opacities * torch.exp(-0.5 * standardised.square().sum(-1))
    direction = torch.stack([surfels.clip_angles.cos(), surfels.clip_angles.sin()], dim=-1)
    along = torch.einsum("rna,nka->rnk", local, direction)
    return alpha * (0.5 + (surfels.clip_offsets - along) / softness).clamp(0.0, 1.0).prod(dim=-1)


def composite_dense(
    surfels: Surfels,
    origins: Tensor,
    directions: Tensor,
    nearest: float = 1e-4,
    two_sided: bool = False,
    thresholds: Tensor | None = None,
) -> tuple[Tensor, Tensor]:
    """Weights (R, N) of every surfel in every ray, and what passes (R,): `kernels.composite.composite`, dense."""
    coverage, normals = surfels.coverage, surfels.normals
    low, high = (coverage.low, coverage.high) if thresholds is None else thresholds
    facing = directions @ normals.T
    met = facing.abs() > GRAZING if two_sided else facing < -GRAZING
    safe = torch.where(met, facing, torch.ones_like(facing))
    depth = ((surfels.centers[None] - origins[:, None]) * normals).sum(-1) / safe
    offsets = origins[:, None] + depth[..., None] * directions[:, None] - surfels.centers
    alpha = alpha_at(surfels, offsets)
    alpha = torch.where(met & (depth > nearest) & (alpha > coverage.minimum_alpha), alpha, torch.zeros_like(alpha))
    weights = torch.zeros_like(alpha)
    passing = torch.ones(len(origins), dtype=alpha.dtype)
    remaining = torch.where(alpha.detach() > 0, depth.detach(), torch.full_like(depth, torch.inf))
    while bool((remaining < torch.inf).any()):
        front = remaining.amin(dim=1, keepdim=True)
        layer = (remaining <= front + coverage.layer_thickness) & (remaining < torch.inf)
        live = passing.detach() >= OPAQUE
        in_layer = torch.where(layer & live[:, None], alpha, torch.zeros_like(alpha))
        covered = smoothstep(1.0 - (1.0 - in_layer).prod(dim=1), low, high)
        total = in_layer.sum(dim=1)
        share = passing * covered / torch.where(total > 0, total, torch.ones_like(total))
        weights = weights + in_layer * share[:, None]
        passing = passing * (1.0 - covered)
        remaining = torch.where(layer, torch.full_like(remaining, torch.inf), remaining)
    return weights, passing


def shade_rays(
    surfels: Surfels, thresholds: Tensor, radiance: Tensor, origins: Tensor, directions: Tensor, ray_view: Tensor
) -> Tensor:
    """(R, 3) colours: `kernels.shade.shade_rays`."""
    weights, _ = composite_dense(surfels, origins, directions, thresholds=thresholds)
    return torch.einsum("rn,rnc->rc", weights, radiance[ray_view.long()])


def transmittance(surfels: Surfels, lights: Tensor) -> Tensor:
    """(L, N) shares of the lights (L, 3) that reach the surfels: `kernels.shadow.transmittance`."""
    coverage, normals, centers = surfels.coverage, surfels.normals, surfels.centers
    scale = surfels.scales.prod(dim=1).sqrt()
    beside = ((centers[None] - centers[:, None]) * normals[:, None]).sum(-1).abs()
    coplanar = (normals @ normals.T > COPLANAR_COSINE) & (beside < COPLANAR_OFFSET * scale[:, None])
    rows = []
    for light in lights:
        path = centers - light
        distance = path.norm(dim=1)
        facing = path @ normals.T
        met = (facing.abs() > 1e-6 * distance[:, None]) & ~coplanar
        safe = torch.where(met, facing, torch.ones_like(facing))
        t = ((centers - light) * normals).sum(-1)[None] / safe
        ahead = (1.0 - t) * (distance / scale)[:, None] - RECEIVER_SKIP
        fade = (ahead / RECEIVER_FADE).clamp(0.0, 1.0)
        alpha = alpha_at(surfels, light + t[..., None] * path[:, None] - centers)
        met = met & (t > 0.0) & (alpha > coverage.minimum_alpha)
        clear = (1.0 - torch.where(met, alpha * fade, torch.zeros_like(alpha))).prod(dim=1)
        lit = (path * normals).sum(dim=1) < 0.0
        share = 1.0 - smoothstep(1.0 - clear, coverage.low, coverage.high)
        rows.append(torch.where(lit, share, torch.ones_like(share)))
    return torch.stack(rows)
