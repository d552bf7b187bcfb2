"""Colours and coverage of composited rays, differentiable towards surfels, coverage thresholds and radiance."""

from __future__ import annotations

from typing import Any

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits, composite
from rgspipe.renderer.kernels.coverage import LayerRule, sharpened, sharpened_slope
from rgspipe.renderer.kernels.launch import as_array, as_vec3, as_vec4, launch
from rgspipe.renderer.kernels.shade_gradients import quaternion_gradient
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, SurfelRecord, clip_height
from rgspipe.scene.surfels import Surfels

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Columns of a surfel's gradient: centre 3, rotation vector 3, log-scales 2, opacity, clip offsets 2, clip angles 2.
GRADIENT_COLUMNS = 13

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


@wp.func
def add_ramp_gradient(
    gradient: wp.array(dtype=float, ndim=3),
    slab: int,
    j: int,
    which: int,
    ramp: wp.vec3,
    u: float,
    v: float,
    aspect: float,
    scaled: float,
):
    """Adds dL/d(offset, angle) of one clip in units of the softness; returns dL/d(u, v) through its ramp."""
    height = clip_height(ramp, u, v)
    to_plane = wp.vec2(0.0, 0.0)
    if height > 0.0 and height < 1.0:
        to_ramp = scaled / wp.max(height, 1.0e-3)
        wp.atomic_add(gradient, slab, j, 9 + which, to_ramp)
        wp.atomic_add(gradient, slab, j, 11 + which, to_ramp * (ramp[2] * u * aspect - ramp[1] * v / aspect))
        to_plane = wp.vec2(-to_ramp * ramp[1], -to_ramp * ramp[2])
    return to_plane


@wp.func
def add_hit_gradient(
    gradient: wp.array(dtype=float, ndim=3),
    slab: int,
    surfels: wp.array(dtype=SurfelRecord),
    record: int,
    j: int,
    x: wp.vec3,
    d: wp.vec3,
    alpha: float,
    to_alpha: float,
):
    """Adds dL/d(surfel j) of a hit at the offset x from its centre, given dL/dα and where the surfel's record is."""
    n = surfels[record].normal
    ua = surfels[record].u_axis
    va = surfels[record].v_axis
    u = wp.dot(x, ua)
    v = wp.dot(x, va)
    scaled = to_alpha * alpha
    # In world units the clips do not move with the scales, so the scales act through u and v alone.
    wp.atomic_add(gradient, slab, j, 6, scaled * u * u)
    wp.atomic_add(gradient, slab, j, 7, scaled * v * v)
    wp.atomic_add(gradient, slab, j, 8, scaled / surfels[record].opacity)
    aspect = wp.length(va) / wp.length(ua)
    ramp_a = add_ramp_gradient(gradient, slab, j, 0, surfels[record].clip_a, u, v, aspect, scaled)
    ramp_b = add_ramp_gradient(gradient, slab, j, 1, surfels[record].clip_b, u, v, aspect, scaled)
    to_u = ramp_a[0] + ramp_b[0] - scaled * u
    to_v = ramp_a[1] + ramp_b[1] - scaled * v
    # A plane that moves or leans also moves the point where the ray meets it.
    lean = (to_u * wp.dot(ua, d) + to_v * wp.dot(va, d)) / wp.dot(d, n)
    to_center = lean * n - to_u * ua - to_v * va
    to_rotation = to_u * wp.cross(ua, x) + to_v * wp.cross(va, x) - lean * wp.cross(n, x)
    for q in range(3):
        wp.atomic_add(gradient, slab, j, q, to_center[q])
        wp.atomic_add(gradient, slab, j, 3 + q, to_rotation[q])


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
