"""Direct irradiance from point lights, with exact derivatives towards the light's position."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from rgspipe.renderer.kernels.shadow import transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh

#: Within this many of its scales a surfel sees a light as if it were farther away: inside a surfel the inverse
#: square has no meaning, and its derivative would grow without bound.
SOFTENING = 1.0


def geometry_factor(positions: Tensor, centers: Tensor, normals: Tensor, scales: Tensor) -> tuple[Tensor, Tensor]:
    """Unshadowed irradiance from unit point lights, max(0, n·d)/(|d|⁴ + ε⁴)^{3/4} with d = light − centre.

    The fourth powers keep the inverse square law where it holds: its relative error is ¾(ε/|d|)⁴.

    Args:
        positions: (L, 3) lights; centers, normals: (N, 3); scales: (N,) ε over SOFTENING, scene units.

    Returns:
        (L, N) irradiance per intensity, 1/scene unit², and its derivative (L, N, 3) towards the position.
    """
    d = positions[:, None] - centers
    square = d.square().sum(-1)
    inverse = (square.square() + (SOFTENING * scales).pow(4)).rsqrt()
    cube = inverse * inverse.sqrt()
    projected = (d * normals).sum(-1)
    lit = projected > 0
    factor = torch.where(lit, projected * cube, torch.zeros_like(cube))
    slope = normals * cube[..., None] - d * (3.0 * projected * square * cube * inverse * inverse)[..., None]
    return factor, torch.where(lit[..., None], slope, torch.zeros_like(slope))


def unit_irradiance(bvh: SurfelBvh, positions: Tensor, shadows: bool = True) -> tuple[Tensor, Tensor]:
    """Irradiance on every surfel from unit point lights, and its derivative.

    Args:
        positions: (L, 3).
        shadows: whether surfels stand in the light's way.

    Returns:
        E (L, N) and dE/dposition (L, N, 3), float32, per W/sr.
    """
    surfels = bvh.surfels
    positions = positions.to(bvh.device, torch.float32)
    scales = surfels.scales.float().prod(dim=1).sqrt()
    factor, slope = geometry_factor(positions, surfels.centers.float(), surfels.normals.float(), scales)
    if not shadows:
        return factor, slope
    share, share_slope = transmittance(bvh, positions)
    return factor * share, slope * share[..., None] + factor[..., None] * share_slope


class _UnitIrradiance(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, positions: Tensor, bvh: SurfelBvh, shadows: bool) -> Tensor:
        irradiance, slope = unit_irradiance(bvh, positions.detach(), shadows)
        ctx.save_for_backward(slope)
        ctx.like = positions.dtype, positions.device
        return irradiance

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:
        (slope,) = ctx.saved_tensors
        dtype, device = ctx.like
        return torch.einsum("ln,lnc->lc", gradient, slope).to(device, dtype), None, None


def differentiable_irradiance(bvh: SurfelBvh, positions: Tensor, shadows: bool = True) -> Tensor:
    """`unit_irradiance` without the derivative, differentiable by autograd towards the positions."""
    return _UnitIrradiance.apply(positions, bvh, shadows)
