"""Transmittance from a light to every surfel, with its derivative towards the light's position."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.composite import sharpened
from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch
from rgspipe.renderer.kernels.surfel_bvh import SurfelArrays, SurfelBvh, surfel_alpha

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: An occluder nearer to the receiver than this many of its scales casts no shadow on it …
RECEIVER_SKIP = wp.constant(1.5)

#: … and within this many more it fades in, so that the image changes smoothly as the light moves.
RECEIVER_FADE = wp.constant(1.0)

#: Neighbours on the receiver's own plane cast no shadow on it: normals within this cosine …
COPLANAR_COSINE = wp.constant(0.8)

#: … and centres within this many receiver scales of its plane.
COPLANAR_OFFSET = wp.constant(1.0)


@wp.func
def opacity_slope(s: SurfelArrays, j: int, x: wp.vec3):
    """−d(ln α)/dx of surfel j at the offset x in its plane, with the ramps of its clips."""
    u = wp.dot(x, s.u_axis[j])
    v = wp.dot(x, s.v_axis[j])
    a = s.clip_a[j]
    b = s.clip_b[j]
    ramp_a = a[0] - a[1] * u - a[2] * v
    ramp_b = b[0] - b[1] * u - b[2] * v
    to_u = u
    to_v = v
    if ramp_a < 1.0:
        to_u += a[1] / ramp_a
        to_v += a[2] / ramp_a
    if ramp_b < 1.0:
        to_u += b[1] / ramp_b
        to_v += b[2] / ramp_b
    return to_u * s.u_axis[j] + to_v * s.v_axis[j]


@wp.kernel
def _transmittance(
    offset: int,
    slab: int,
    bvh: wp.uint64,
    s: SurfelArrays,
    lights: wp.array(dtype=wp.vec3),
    receivers: int,
    minimum_alpha: float,
    low: float,
    high: float,
    transmittance: wp.array(dtype=float),
    derivative: wp.array(dtype=wp.vec3),
):
    item = wp.tid() + offset
    light = lights[item / receivers]
    i = item % receivers
    ni = s.normal[i]
    path = s.center[i] - light
    distance = wp.length(path)
    clear = float(1.0)
    log_derivative = wp.vec3(0.0, 0.0, 0.0)
    if wp.dot(path, ni) < 0.0 and distance > 0.0:
        # From the receiver: the light may be so far away that rounding there is larger than the scene.
        query = wp.bvh_query_ray(bvh, s.center[i], -path / distance)
        j = int(0)
        while wp.bvh_query_next(query, j, distance):
            nj = s.normal[j]
            facing = wp.dot(path, nj)
            coplanar = (
                wp.dot(nj, ni) > COPLANAR_COSINE
                and wp.abs(wp.dot(s.center[j] - s.center[i], ni)) < COPLANAR_OFFSET * s.scale[i]
            )
            if wp.abs(facing) > 1.0e-6 * distance and not coplanar:
                # Where the ray meets the plane: shares of the way from the light, and back from the receiver.
                # Each is exact at its own end, and the two are not one minus the other in float32.
                t = wp.dot(s.center[j] - light, nj) / facing
                back = wp.dot(s.center[i] - s.center[j], nj) / facing
                fade = wp.min(back * distance / s.scale[i] - RECEIVER_SKIP, RECEIVER_FADE) / RECEIVER_FADE
                if t > 0.0 and fade > 0.0:
                    x = s.center[i] - s.center[j] - back * path
                    alpha = surfel_alpha(s, j, x)
                    if alpha > minimum_alpha:
                        slope = alpha * fade * opacity_slope(s, j, x)
                        # The ray's meeting point moves by back·dl along the plane, corrected to stay on it.
                        change = back * (slope - nj * (wp.dot(slope, path) / facing))
                        if fade < 1.0:
                            change -= (alpha * back / (s.scale[i] * RECEIVER_FADE)) * (
                                nj * (distance / facing) - path / distance
                            )
                        clear = clear * (1.0 - alpha * fade)
                        log_derivative += change / wp.max(1.0 - alpha * fade, 1.0e-4)
                        if 1.0 - clear >= high:
                            break
    y = wp.clamp((1.0 - clear - low) / (high - low), 0.0, 1.0)
    transmittance[item] = 1.0 - sharpened(1.0 - clear, low, high)
    derivative[item] = log_derivative * (clear * 6.0 * y * (1.0 - y) / (high - low))


def transmittance(bvh: SurfelBvh, lights: Tensor) -> tuple[Tensor, Tensor]:
    """Share of each light that reaches each surfel, and how it changes as the light moves.

    All occluders of a shadow ray form one layer; they are two-sided. Surfels that face away from the
    light get 1: their irradiance is zero by the cosine.

    Args:
        lights: (L, 3) positions.

    Returns:
        transmittance (L, N) and its derivative towards the light's position (L, N, 3), float32.
    """
    count, receivers, c = lights.shape[0], len(bvh.surfels), bvh.coverage
    shares = torch.empty((count, receivers), dtype=torch.float32, device=bvh.device)
    derivative = torch.empty((count, receivers, 3), dtype=torch.float32, device=bvh.device)
    inputs = [bvh.id, bvh.arrays, as_vec3(lights.to(bvh.device)), receivers, c.minimum_alpha, c.low, c.high]
    outputs = [as_array(shares.view(-1)), as_vec3(derivative.view(-1, 3))]
    launch(_transmittance, count * receivers, [*inputs, *outputs], bvh.device)
    return shares, derivative
