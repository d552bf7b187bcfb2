"""Colours and coverage of composited rays, differentiable towards surfels, coverage thresholds and radiance."""

from __future__ import annotations

from typing import Any

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits, composite
from rgspipe.renderer.kernels.coverage import LayerRule, sharpened, sharpened_slope
from rgspipe.renderer.kernels.hit_gradient import GRADIENT_COLUMNS, add_hit_gradient
from rgspipe.renderer.kernels.launch import as_array, as_vec3, as_vec4, launch
from rgspipe.renderer.kernels.shade_gradients import quaternion_gradient
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, SurfelRecord
from rgspipe.scene.surfels import Surfels

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Private gradients that are added up at the end, of a fixed part of the rays each: their number is part of the result,
#: so it is none of the machine's. More cores than this would wait; each takes 52 bytes a surfel.
SLABS = 8


@wp.kernel
def _shade(
    offset: int,
    slab: int,
    indices: wp.array(dtype=int, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    ray_view: wp.array(dtype=int),
    radiance: wp.array(dtype=wp.vec3, ndim=2),
    colours: wp.array(dtype=wp.vec4),
):
    i = wp.tid() + offset
    view = ray_view[i]
    colour = wp.vec3(0.0, 0.0, 0.0)
    covered = float(0.0)
    k = int(0)
    while k < indices.shape[1] and indices[i, wp.min(k, indices.shape[1] - 1)] >= 0:
        colour += weights[i, k] * radiance[view, indices[i, k]]
        covered += weights[i, k]
        k += 1
    colours[i] = wp.vec4(colour[0], colour[1], colour[2], covered)


@wp.kernel
def _shade_adjoint(
    offset: int,
    slab: int,
    surfels: wp.array(dtype=SurfelRecord),
    rank: wp.array(dtype=int),
    rule: LayerRule,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    indices: wp.array(dtype=int, ndim=2),
    depths: wp.array(dtype=float, ndim=2),
    alphas: wp.array(dtype=float, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    ray_view: wp.array(dtype=int),
    radiance: wp.array(dtype=wp.vec3, ndim=2),
    ray_gradient: wp.array(dtype=wp.vec4),
    to_weight: wp.array(dtype=float, ndim=2),
    layer_passing: wp.array(dtype=float, ndim=2),
    layer_first: wp.array(dtype=int, ndim=2),
    gradient: wp.array(dtype=float, ndim=3),
    threshold_gradient: wp.array(dtype=float, ndim=2),
    radiance_gradient: wp.array(dtype=wp.vec3, ndim=3),
):
    i = wp.tid() + offset
    o = origins[i]
    d = directions[i]
    view = ray_view[i]
    width = indices.shape[1]
    to_colour = wp.vec3(ray_gradient[i][0], ray_gradient[i][1], ray_gradient[i][2])
    count = int(0)
    while count < width and indices[i, wp.min(count, width - 1)] >= 0:
        seen = indices[i, count]
        to_weight[i, count] = wp.dot(to_colour, radiance[view, seen]) + ray_gradient[i][3]
        if radiance_gradient.shape[2] > 0:
            wp.atomic_add(radiance_gradient, slab, view, seen, weights[i, count] * to_colour)
        count += 1
    # Front to back: what reaches each layer, noted at its last hit.
    passing = float(1.0)
    k = int(0)
    while k < count:
        clear = float(1.0)
        end = int(k)
        back = depths[i, k] + rule.thickness
        while end < count and depths[i, wp.min(end, width - 1)] <= back:
            clear = clear * (1.0 - alphas[i, end])
            end += 1
        layer_passing[i, end - 1] = passing
        layer_first[i, end - 1] = k
        passing = passing * (1.0 - sharpened(clear, rule))
        k = end
    # Back to front: `behind` is what would be seen if everything before were taken away.
    behind = float(0.0)
    end = int(count)
    while end > 0:
        first = layer_first[i, end - 1]
        passing = layer_passing[i, end - 1]
        total = float(0.0)
        clear = float(1.0)
        mixed = float(0.0)
        for m in range(first, end):
            total += alphas[i, m]
            clear = clear * (1.0 - alphas[i, m])
            mixed += alphas[i, m] * to_weight[i, m]
        mixed = mixed / total
        covered = sharpened(clear, rule)
        to_raw = passing * (mixed - behind) * sharpened_slope(clear, rule)
        # 1 − P = low + y (high − low): how far the layer is from either threshold.
        y = wp.clamp((1.0 - clear - rule.low) / (rule.high - rule.low), 0.0, 1.0)
        wp.atomic_add(threshold_gradient, slab, 0, to_raw * (y - 1.0))
        wp.atomic_add(threshold_gradient, slab, 1, -to_raw * y)
        for m in range(first, end):
            alpha = alphas[i, m]
            to_alpha = passing * covered * (to_weight[i, m] - mixed) / total
            to_alpha += to_raw * clear / wp.max(1.0 - alpha, 1.0e-4)
            j = indices[i, m]
            r = rank[j]
            x = o + depths[i, m] * d - surfels[r].center
            add_hit_gradient(gradient, slab, surfels, r, j, x, d, alpha, to_alpha)
        behind = covered * mixed + (1.0 - covered) * behind
        end = first


class _ShadeRays(torch.autograd.Function):
    """Ray colours from surfel tensors; the hierarchy in `bvh` must have been built from the same tensors."""

    @staticmethod
    def forward(
        ctx: Any, bvh: SurfelBvh, rays: tuple[Tensor, ...], hits: Hits, radiance: Tensor, *parameters: Tensor
    ) -> Tensor:
        origins, _, ray_view = rays
        colours = torch.empty((origins.shape[0], 4), dtype=torch.float32, device=bvh.device)
        radiance_array = wp.from_torch(radiance.detach().float().contiguous(), dtype=wp.vec3)
        arguments = [as_array(hits.indices), as_array(hits.weights), as_array(ray_view), radiance_array]
        launch(_shade, origins.shape[0], [*arguments, as_vec4(colours)], bvh.device)
        ctx.bvh, ctx.rays, ctx.hits = bvh, rays, hits
        ctx.save_for_backward(radiance, *parameters)
        return colours

    @staticmethod
    def backward(ctx: Any, colour_gradient: Tensor) -> tuple[Tensor | None, ...]:
        radiance, _centers, rotations, scales, *_rest = ctx.saved_tensors
        wanted = ctx.needs_input_grad[3]
        packed, thresholds, to_radiance = _gradients(ctx.bvh, ctx.rays, ctx.hits, radiance, colour_gradient, wanted)
        softness = ctx.bvh.coverage.clip_softness
        return (
            None,
            None,
            None,
            to_radiance if wanted else None,
            packed[:, 0:3],
            quaternion_gradient(rotations, packed[:, 3:6]),
            # By the scales that rays meet: those of surfels without extent are not zero there.
            packed[:, 6:8] / ctx.bvh.surfels.scales.to(scales),
            packed[:, 8],
            packed[:, 9:11] / softness,
            packed[:, 11:13],
            thresholds,
        )


def _gradients(
    bvh: SurfelBvh,
    rays: tuple[Tensor, ...],
    hits: Hits,
    radiance: Tensor,
    colour_gradient: Tensor,
    to_radiance: bool,
) -> tuple[Tensor, Tensor, Tensor]:
    """(N, GRADIENT_COLUMNS), (2,) and (V, N, 3) gradients of Σ colour_gradient · colour; the last is none if unwanted.

    Each slab takes 12 bytes a surfel and view for the radiance, less than what is kept of the rays of a view.
    """
    origins, directions, ray_view = rays
    count, device = origins.shape[0], bvh.device
    slabs = SLABS if device.type == "cpu" else 1
    views, surfels = radiance.shape[:2] if to_radiance else (0, 0)

    def zeros(*shape: int) -> Tensor:
        return torch.zeros((slabs, *shape), dtype=torch.float32, device=device)

    packed, thresholds, shown = zeros(len(bvh.surfels), GRADIENT_COLUMNS), zeros(2), zeros(views, surfels, 3)
    scratch = [torch.empty_like(hits.weights), torch.empty_like(hits.weights), torch.empty_like(hits.indices)]
    arguments = [bvh.records, bvh.rank, bvh.rule, as_vec3(bvh.local(origins)), as_vec3(directions)]
    arguments += [as_array(x) for x in (hits.indices, hits.depths, hits.alphas, hits.weights, ray_view)]
    arguments += [wp.from_torch(radiance.detach().float().contiguous(), dtype=wp.vec3), as_vec4(colour_gradient)]
    arguments += [as_array(x) for x in (*scratch, packed, thresholds)]
    launch(_shade_adjoint, count, [*arguments, wp.from_torch(shown, dtype=wp.vec3)], device, slabs=slabs)
    return packed.sum(dim=0), thresholds.sum(dim=0), shown.sum(dim=0)


def shade_rays(
    bvh: SurfelBvh,
    surfels: Surfels,
    thresholds: Tensor,
    radiance: Tensor,
    origins: Tensor,
    directions: Tensor,
    ray_view: Tensor,
) -> Tensor:
    """Colours seen along rays and how far they are covered, with gradients towards surfels, thresholds and radiance.

    The gradient takes the order of hits and their grouping into layers as given: at the instants where
    they change the image jumps by less than the noise of a pixel, and no derivative exists there.

    Args:
        bvh: the hierarchy over `surfels`.
        surfels: float32; those of its tensors that require it receive gradients (clips and opacity too).
        thresholds: (2,) the coverage's low and high, as a tensor that may require a gradient.
        radiance: (V, N, 3) outgoing radiance of every surfel in each of V lightings.
        origins, directions: (R, 3).
        ray_view: (R,) which of the V lightings each ray sees.

    Returns:
        (R, 4) float32 radiance, and the share of the ray that surfels stop.
    """
    device = bvh.device
    hits = composite(bvh, origins.detach(), directions.detach())
    rays = (origins.detach(), directions.detach().to(device, torch.float32), ray_view.to(device, torch.int32))
    return _ShadeRays.apply(
        bvh,
        rays,
        hits,
        radiance,
        surfels.centers,
        surfels.rotations,
        surfels.scales,
        surfels.opacities,
        surfels.clip_offsets,
        surfels.clip_angles,
        thresholds,
    )
