"""What a ray sees as one surface: the mean normal and distance of its hits."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits
from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _mean_surface(
    offset: int,
    slab: int,
    indices: wp.array(dtype=int, ndim=2),
    depths: wp.array(dtype=float, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    normals: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    distance: wp.array(dtype=float),
):
    ray = wp.tid() + offset
    direction = wp.vec3(0.0, 0.0, 0.0)
    far = float(0.0)
    total = float(0.0)
    k = int(0)
    while k < indices.shape[1]:
        j = indices[ray, k]
        if j < 0:
            break
        weight = weights[ray, k]
        direction += weight * normals[j]
        far += weight * depths[ray, k]
        total += weight
        k += 1
    total = wp.max(total, 1.0e-6)
    normal[ray] = direction / total
    distance[ray] = far / total


def mean_surface(hits: Hits, normals: Tensor) -> tuple[Tensor, Tensor]:
    """(R, 3) normals and (R,) distances, float32, averaged by weight over the hits of R rays; zero without hits.

    Args:
        normals: (N, 3) float32 of the surfels.
    """
    count, device = hits.indices.shape[0], hits.indices.device
    normal, distance = torch.empty((count, 3), device=device), torch.empty(count, device=device)
    inputs = [as_array(x) for x in (hits.indices, hits.depths, hits.weights)]
    launch(_mean_surface, count, [*inputs, as_vec3(normals), as_vec3(normal), as_array(distance)], device, even=True)
    return normal, distance
