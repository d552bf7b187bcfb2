"""Cast rays through surfels and composite what they meet in layers.

Per ray, with hits sorted by depth t and grouped into layers of one thickness (docs/model.md):

    P_ℓ = Π_k (1 − α_k)            raw transparency of layer ℓ
    C_ℓ = smoothstep(low, high)(1 − P_ℓ)
    w_k = T_ℓ · C_ℓ · α_k / Σ_{m∈ℓ} α_m,   T_{ℓ+1} = T_ℓ (1 − C_ℓ)
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch
from rgspipe.renderer.kernels.surfel_bvh import SurfelArrays, SurfelBvh, surfel_alpha

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Hits kept per ray, the nearest ones. Measured rays need 8 to 30; layers behind an opaque one do not count.
MAX_HITS = wp.constant(48)

#: Light that gets past a layer below this share is not followed further.
OPAQUE = wp.constant(1.0e-3)

#: A ray closer to a surfel's plane than this cosine does not meet it.
GRAZING = wp.constant(1.0e-5)


@dataclass(frozen=True)
class Hits:
    """What rays meet. Rows are rays, columns hits in order of depth; unused columns hold index −1 and weight 0.

    Attributes:
        indices: (R, K) int32 surfel of each hit.
        depths: (R, K) float32 distance along the ray.
        alphas: (R, K) float32 opacity of the surfel at the hit.
        weights: (R, K) float32 share of the surfel's radiance in the ray's; rows sum to 1 − transmittance.
        transmittance: (R,) float32 share that passes every layer.
    """

    indices: Tensor
    depths: Tensor
    alphas: Tensor
    weights: Tensor
    transmittance: Tensor


@wp.func
def sharpened(raw: float, low: float, high: float):
    y = wp.clamp((raw - low) / (high - low), 0.0, 1.0)
    return y * y * (3.0 - 2.0 * y)


@wp.kernel
def _composite(
    offset: int,
    slab: int,
    bvh: wp.uint64,
    s: SurfelArrays,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    nearest: float,
    two_sided: int,
    layer: float,
    minimum_alpha: float,
    low: float,
    high: float,
    indices: wp.array(dtype=int, ndim=2),
    depths: wp.array(dtype=float, ndim=2),
    alphas: wp.array(dtype=float, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    transmittance: wp.array(dtype=float),
):
    i = wp.tid() + offset
    o = origins[i]
    d = directions[i]
    query = wp.bvh_query_ray(bvh, o, d)
    count = int(0)
    j = int(0)
    while wp.bvh_query_next(query, j):
        n = s.normal[j]
        facing = wp.dot(d, n)
        if facing < -GRAZING or (two_sided == 1 and facing > GRAZING):
            t = wp.dot(s.center[j] - o, n) / facing
            if t > nearest:
                alpha = surfel_alpha(s, j, o + t * d - s.center[j])
                if alpha > minimum_alpha:
                    # Insertion sort into the nearest MAX_HITS.
                    m = int(count)
                    if count == MAX_HITS:
                        if t < depths[i, MAX_HITS - 1]:
                            m = MAX_HITS - 1
                        else:
                            m = -1
                    else:
                        count += 1
                    if m >= 0:
                        while m > 0 and depths[i, wp.max(m - 1, 0)] > t:
                            depths[i, m] = depths[i, m - 1]
                            indices[i, m] = indices[i, m - 1]
                            alphas[i, m] = alphas[i, m - 1]
                            m -= 1
                        depths[i, m] = t
                        indices[i, m] = j
                        alphas[i, m] = alpha
    passing = float(1.0)
    k = int(0)
    while k < count:
        total = float(0.0)
        clear = float(1.0)
        end = int(k)
        front = depths[i, k]
        while end < count and depths[i, wp.min(end, MAX_HITS - 1)] <= front + layer:
            total += alphas[i, end]
            clear = clear * (1.0 - alphas[i, end])
            end += 1
        covered = sharpened(1.0 - clear, low, high)
        share = passing * covered / total
        for m in range(k, end):
            weights[i, m] = alphas[i, m] * share
        passing = passing * (1.0 - covered)
        k = end
        if passing < OPAQUE:
            count = k
    transmittance[i] = passing
    for m in range(count, MAX_HITS):
        indices[i, m] = -1
        weights[i, m] = 0.0


def composite(
    bvh: SurfelBvh, origins: Tensor, directions: Tensor, nearest: float = 1e-4, two_sided: bool = False
) -> Hits:
    """Cast rays and composite what they meet, nearest layers first.

    Args:
        origins, directions: (R, 3), directions of unit length.
        nearest: hits at or before this distance are passed over, scene units.
        two_sided: whether backs of surfels are met, too.
    """
    count, device, c = origins.shape[0], bvh.device, bvh.coverage
    shape = (count, int(MAX_HITS))
    hits = Hits(
        indices=torch.empty(shape, dtype=torch.int32, device=device),
        depths=torch.empty(shape, dtype=torch.float32, device=device),
        alphas=torch.empty(shape, dtype=torch.float32, device=device),
        weights=torch.empty(shape, dtype=torch.float32, device=device),
        transmittance=torch.empty(count, dtype=torch.float32, device=device),
    )
    if len(bvh.surfels) == 0:
        hits.indices.fill_(-1)
        hits.weights.zero_()
        hits.transmittance.fill_(1.0)
        return hits
    rays = [as_vec3(origins.to(device)), as_vec3(directions.to(device))]
    rule = [float(nearest), int(two_sided), c.layer_thickness, c.minimum_alpha, c.low, c.high]
    outputs = [as_array(x) for x in (hits.indices, hits.depths, hits.alphas, hits.weights, hits.transmittance)]
    launch(_composite, count, [bvh.id, bvh.arrays, *rays, *rule, *outputs], device)
    return hits
