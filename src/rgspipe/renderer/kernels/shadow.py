"""How much of a light reaches a surfel: a shadow ray through the same layers as every other ray.

Layers are counted from the light. Occluders that are met from behind fade in near the receiver (`RECEIVER_SKIP`), and
there they come last: one that appears with opacity 0 joins or follows the layers that are there and moves none of
their fronts, so that the transmittance stays continuous as the light moves.

From behind a ray meets what protrudes at a convex edge, a side's footprint above the top, which is error; from the
front it meets the other wall of a corner, behind which no light of the room is, but one behind the room: a sun, whose
light through the first row of surfels beside each joint would be 5 to 50 % of all that comes in.
"""

from __future__ import annotations

import warp as wp

from rgspipe.renderer.kernels.coverage import sharpened, sharpened_slope, smoothstep, smoothstep_slope
from rgspipe.renderer.kernels.places import way_to
from rgspipe.renderer.kernels.receiver import RECEIVER_FADE, RECEIVER_SKIP, on_own_surface
from rgspipe.renderer.kernels.surfel_bvh import SurfelRecord, SurfelTree, clip_height, surfel_alpha

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: An occluder fades out as a ray comes nearer to its plane than this cosine, from where on its disc is a line. Rays
#: that nearly lie in the plane of a wall meet one of its surfels here and there, each for a sliver of the light's
#: places, and the derivative within a sliver says nothing of a step of the light. Half and twice of it were not tried.
EDGE_ON = wp.constant(0.02)

#: Below this part of it nothing is met.
IN_PLANE = wp.constant(1.0e-4)

#: Rays to a light at infinity end here.
ENDLESS = wp.constant(1.0e30)

#: Occluders that a ray holds at once; if there are more, it goes on behind the last of them.
OCCLUDERS = wp.constant(16)


@wp.func
def faded_in(way: float, scale: float, facing: float):
    """Share of its opacity that an occluder has at the distance `way` from a receiver of `scale`; none up to 0.

    Opacity and slope both ask here: were it worked out in two ways, one might round to 0 where the other does not.

    Args:
        facing: of the ray from the receiver along the occluder's normal; negative where it meets the front.
    """
    fade = wp.min((way / scale - RECEIVER_SKIP) / RECEIVER_FADE, 1.0)
    if facing < 0.0:
        fade = wp.where(way > 0.0, 1.0, 0.0)
    return fade


@wp.func
def occluder(
    surfels: wp.array(dtype=SurfelRecord),
    minimum_alpha: float,
    receiver: int,
    at: wp.vec3,
    j: int,
    light: wp.vec4,
    path: wp.vec3,
    distance: float,
):
    """Opacity of surfel j, faded in, on the `path` from `at` to the light, and its depth there; or 0, 0.

    Depths are shares of the path; of the path to a light at infinity, which is a unit vector, lengths.
    """
    alpha = float(0.0)
    depth = float(0.0)
    n = surfels[j].normal
    facing = wp.dot(path, n)
    # From the receiver: the light may be so far away that rounding there is larger than the scene.
    between = surfels[j].center - at
    own = surfels[receiver].normal
    scale = surfels[receiver].scale
    cosine = wp.abs(facing) / distance
    if cosine > IN_PLANE * EDGE_ON and not on_own_surface(n, own, between, scale):
        depth = wp.dot(between, n) / facing
        fade = faded_in(depth * distance, scale, facing)
        if fade > 0.0 and wp.dot(way_to(light, surfels[j].center), n) * facing > 0.0:
            alpha = surfel_alpha(surfels, j, depth * path - between)
            if alpha <= minimum_alpha:
                alpha = float(0.0)
            alpha *= fade * smoothstep(cosine / EDGE_ON)
    return alpha, depth


@wp.func
def comes_before(depth: float, j: int, other_depth: float, other: int):
    """Whether a ray from the light meets surfel j before another one."""
    return depth > other_depth or (depth == other_depth and j < other)


@wp.func
def opacity_slope(surfels: wp.array(dtype=SurfelRecord), j: int, x: wp.vec3):
    """−d(ln α)/dx of surfel j at the offset x in its plane, with the ramps of its clips."""
    u = wp.dot(x, surfels[j].u_axis)
    v = wp.dot(x, surfels[j].v_axis)
    a = surfels[j].clip_a
    b = surfels[j].clip_b
    height_a = clip_height(a, u, v)
    height_b = clip_height(b, u, v)
    to_u = u
    to_v = v
    if height_a < 1.0:
        to_u += a[1] / height_a
        to_v += a[2] / height_a
    if height_b < 1.0:
        to_u += b[1] / height_b
        to_v += b[2] / height_b
    return to_u * surfels[j].u_axis + to_v * surfels[j].v_axis


@wp.func
def occluder_slope(
    surfels: wp.array(dtype=SurfelRecord),
    receiver: int,
    at: wp.vec3,
    j: int,
    path: wp.vec3,
    distance: float,
    alpha: float,
    depth: float,
):
    """−dα/d(light) of an `occluder`."""
    n = surfels[j].normal
    facing = wp.dot(path, n)
    fade = faded_in(depth * distance, surfels[receiver].scale, facing)
    x = depth * path - (surfels[j].center - at)
    slope = alpha * opacity_slope(surfels, j, x)
    # As the light moves by dl, the meeting point moves by its share of the way, corrected to stay on the plane.
    change = depth * (slope - n * (wp.dot(slope, path) / facing))
    if fade < 1.0:
        steepness = RECEIVER_FADE * surfels[receiver].scale
        change -= (alpha / fade * depth / steepness) * (path / distance - n * (distance / facing))
    y = wp.abs(facing) / (EDGE_ON * distance)
    if y < 1.0:
        change -= (alpha * y * smoothstep_slope(y) / smoothstep(y)) * (n / facing - path / (distance * distance))
    return change


@wp.func
def light_transmittance(
    tree: SurfelTree,
    receiver: int,
    at: wp.vec3,
    light: wp.vec4,
    path: wp.vec3,
):
    """Part of a light that reaches the point `at` of a receiver along the `path` to it, and d/d(light) of it."""
    surfels = tree.records
    rule = tree.rule
    passing = float(1.0)
    slope = wp.vec3(0.0, 0.0, 0.0)
    distance = wp.length(path)
    thickness = rule.thickness / distance
    farthest = wp.where(light[3] > 0.0, 1.0, ENDLESS)
    skip = tree.starts[receiver] / distance
    start = at + skip * path
    # The layer that is being filled.
    front = float(1.0e30)
    clear = float(1.0)
    log_slope = wp.vec3(0.0, 0.0, 0.0)
    # Occluders, the nearest to the light first; of those at one depth the surfel with the smallest number.
    depths = wp.zeros(shape=(16,), dtype=float)
    alphas = wp.zeros(shape=(16,), dtype=float)
    indices = wp.zeros(shape=(16,), dtype=int)
    last_depth = float(1.0e30)
    last_index = int(-1)
    more = int(1)
    while more == 1:
        more = int(0)
        count = int(0)
        reach = wp.min(farthest, last_depth + thickness) - skip
        query = wp.bvh_query_ray(tree.bvh, start, path)
        j = int(0)
        while wp.bvh_query_next(query, j, reach):
            alpha, depth = occluder(surfels, rule.minimum_alpha, receiver, at, j, light, path, distance)
            if alpha > 0.0 and (depth < last_depth or (depth == last_depth and j > last_index)):
                if alpha >= rule.high:  # opaque in whichever layer it falls
                    passing = float(0.0)
                    break
                m = int(count)
                if count < OCCLUDERS:
                    count += 1
                else:
                    more = int(1)
                    m = OCCLUDERS - 1
                    if comes_before(depths[m], indices[m], depth, j):
                        m = int(-1)
                if m >= 0:
                    while m > 0 and comes_before(depth, j, depths[wp.max(m - 1, 0)], indices[wp.max(m - 1, 0)]):
                        depths[m] = depths[m - 1]
                        alphas[m] = alphas[m - 1]
                        indices[m] = indices[m - 1]
                        m -= 1
                    depths[m] = depth
                    alphas[m] = alpha
                    indices[m] = j
        k = int(0)
        while k < count and passing > 0.0:
            last_depth = depths[k]
            last_index = indices[k]
            alpha = alphas[k]
            if last_depth < front - thickness:
                covered = sharpened(clear, rule)
                slope = (1.0 - covered) * slope + (passing * sharpened_slope(clear, rule) * clear) * log_slope
                passing *= 1.0 - covered
                front = last_depth
                clear = float(1.0)
                log_slope = wp.vec3(0.0, 0.0, 0.0)
            change = occluder_slope(surfels, receiver, at, last_index, path, distance, alpha, last_depth)
            log_slope += change / wp.max(1.0 - alpha, 1.0e-4)
            clear *= 1.0 - alpha
            if 1.0 - clear >= rule.high:
                passing = float(0.0)
            k += 1
        if passing <= 0.0:
            more = int(0)
    covered = sharpened(clear, rule)
    slope = (1.0 - covered) * slope + (passing * sharpened_slope(clear, rule) * clear) * log_slope
    passing *= 1.0 - covered
    if passing <= 0.0:
        slope = wp.vec3(0.0, 0.0, 0.0)
    return passing, slope
