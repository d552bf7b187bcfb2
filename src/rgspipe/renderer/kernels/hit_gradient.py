"""What one hit of a ray adds to the gradient of the surfel that it meets."""

from __future__ import annotations

import warp as wp

from rgspipe.renderer.kernels.surfel_bvh import SurfelRecord, clip_height

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Columns of a surfel's gradient: centre 3, rotation vector 3, log-scales 2, opacity, clip offsets 2, clip angles 2.
GRADIENT_COLUMNS = 13


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
