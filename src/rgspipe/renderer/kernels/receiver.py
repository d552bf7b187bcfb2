"""Where the shadow rays of a receiver begin to look for occluders."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: An occluder met from behind nearer to the receiver than this many of its scales casts no shadow on it …
RECEIVER_SKIP = wp.constant(1.5)

#: … and within this many more it fades in, so that the image changes smoothly as the light moves.
RECEIVER_FADE = wp.constant(1.0)

#: Neighbours on the receiver's own plane cast no shadow on it: normals within this cosine …
COPLANAR_COSINE = wp.constant(0.8)

#: … and centres within this many receiver scales of its plane.
COPLANAR_OFFSET = wp.constant(1.0)


@wp.func
def on_own_surface(normal: wp.vec3, own: wp.vec3, between: wp.vec3, scale: float):
    """Whether a surfel with the `normal`, `between` away, lies on the surface of a receiver of `scale`."""
    return wp.dot(normal, own) > COPLANAR_COSINE and wp.abs(wp.dot(between, own)) < COPLANAR_OFFSET * scale


@wp.kernel
def _ray_starts(
    offset: int,
    slab: int,
    bvh: wp.uint64,
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    centers: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    scales: wp.array(dtype=float),
    starts: wp.array(dtype=float),
):
    i = wp.tid() + offset
    start = RECEIVER_SKIP * scales[i]
    margin = wp.vec3(start, start, start)
    query = wp.bvh_query_aabb(bvh, lower[i] - margin, upper[i] + margin)
    j = int(0)
    while wp.bvh_query_next(query, j):
        between = centers[j] - centers[i]
        if wp.dot(between, normals[j]) < 0.0 and not on_own_surface(normals[j], normals[i], between, scales[i]):
            start = float(0.0)
    starts[i] = start


def ray_starts(bvh: wp.Bvh, centers: Tensor, normals: Tensor, scales: Tensor) -> Tensor:
    """(N,) float32 distance from each receiver at which its shadow rays begin: 0 beside the front of another surface.

    Elsewhere they need not look where all that they could meet is met from behind, and casts no shadow.

    Args:
        bvh: of the boxes around footprints.
        centers, normals: (N, 3); scales: (N,); float32, in the order of the hierarchy.
    """
    starts = torch.empty_like(scales)
    inputs = [bvh.id, bvh.lowers, bvh.uppers, as_vec3(centers), as_vec3(normals), as_array(scales), as_array(starts)]
    launch(_ray_starts, len(scales), inputs, scales.device)
    return starts
