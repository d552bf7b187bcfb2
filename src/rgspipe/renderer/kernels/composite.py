"""Cast rays through surfels and composite what they meet in layers.

Per ray, with hits sorted by depth and grouped into layers as `kernels.coverage` says:

    w_k = T_ℓ · C_ℓ · α_k / Σ_{m∈ℓ} α_m
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.coverage import sharpened
from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, SurfelTree, surfel_alpha

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Hits that a row holds at first. Measured rays need 8 to 30; those that need more are cast again with wider rows.
USUAL_HITS = 40

#: How much wider.
WIDENING = 4

#: Light that gets past a layer below this share is not followed further.
OPAQUE = wp.constant(1.0e-3)

#: A ray closer to a surfel's plane than this cosine does not meet it.
GRAZING = wp.constant(1.0e-5)


@dataclass(frozen=True)
class Hits:
    """What rays meet. Rows are rays, columns hits in order of depth; unused columns hold index −1 and weight 0.

    K is as large as the ray with most hits before its light ends needs it: no hit is left out.

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


@wp.kernel
def _composite(
    offset: int,
    slab: int,
    tree: SurfelTree,
    order: wp.array(dtype=int),
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    nearest: float,
    two_sided: int,
    indices: wp.array(dtype=int, ndim=2),
    depths: wp.array(dtype=float, ndim=2),
    alphas: wp.array(dtype=float, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    transmittance: wp.array(dtype=float),
    cut: wp.array(dtype=int),
):
    i = wp.tid() + offset
    surfels = tree.records
    rule = tree.rule
    width = indices.shape[1]
    o = origins[i]
    d = directions[i]
    query = wp.bvh_query_ray(tree.bvh, o, d)
    count = int(0)
    dropped = int(0)
    # Nothing is seen behind the layer of an opaque hit.
    farthest = float(1.0e30)
    j = int(0)
    while wp.bvh_query_next(query, j, farthest):
        n = surfels[j].normal
        facing = wp.dot(d, n)
        if facing < -GRAZING or (two_sided == 1 and facing > GRAZING):
            t = wp.dot(surfels[j].center - o, n) / facing
            if t > nearest and t <= farthest:
                alpha = surfel_alpha(surfels, j, o + t * d - surfels[j].center)
                if alpha > rule.minimum_alpha:
                    if alpha >= rule.high:
                        farthest = wp.min(farthest, t + rule.thickness)
                    # Insertion sort into the nearest of the row.
                    m = int(count)
                    if count < width:
                        count += 1
                    else:
                        dropped = int(1)
                        m = width - 1
                        if t >= depths[i, m]:
                            m = int(-1)
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
    while k < count and passing >= OPAQUE:
        total = float(0.0)
        clear = float(1.0)
        end = int(k)
        back = depths[i, k] + rule.thickness
        while end < count and depths[i, wp.min(end, width - 1)] <= back:
            total += alphas[i, end]
            clear = clear * (1.0 - alphas[i, end])
            end += 1
        covered = sharpened(clear, rule)
        share = passing * covered / total
        for m in range(k, end):
            weights[i, m] = alphas[i, m] * share
            indices[i, m] = order[indices[i, m]]
        passing = passing * (1.0 - covered)
        k = end
    # What was dropped lies behind the last hit of a full row, in its layer or farther away.
    cut[i] = 0
    if dropped == 1 and k == count:
        cut[i] = 1
    transmittance[i] = passing
    for m in range(k, width):
        indices[i, m] = -1
        weights[i, m] = 0.0


def composite(
    bvh: SurfelBvh, origins: Tensor, directions: Tensor, nearest: float = 1e-4, two_sided: bool = False
) -> Hits:
    """Cast rays and composite what they meet, nearest layers first.

    Args:
        origins, directions: (R, 3), directions of unit length; float64 origins keep their digits far from
            the scene's origin.
        nearest: hits at or before this distance are passed over, scene units.
        two_sided: whether backs of surfels are met, too.
    """
    rays = bvh.local(origins), directions.to(bvh.device, torch.float32).contiguous()
    return _cast(bvh, rays, float(nearest), two_sided, min(USUAL_HITS, max(len(bvh.surfels), 1)))


def _cast(bvh: SurfelBvh, rays: tuple[Tensor, Tensor], nearest: float, two_sided: bool, width: int) -> Hits:
    """Composite with rows of `width` hits; rays that need more are cast again with wider ones."""
    count, device = len(rays[0]), bvh.device
    integers, numbers = ({"dtype": dtype, "device": device} for dtype in (torch.int32, torch.float32))
    rows = [torch.empty((count, width), **numbers) for _ in range(3)]
    hits = Hits(torch.empty((count, width), **integers), *rows, torch.empty(count, **numbers))
    if len(bvh.surfels) == 0:
        return Hits(hits.indices.fill_(-1), *(row.zero_() for row in rows), hits.transmittance.fill_(1.0))
    cut = torch.empty(count, **integers)
    inputs = [bvh.tree, bvh.order, *(as_vec3(x) for x in rays), nearest, int(two_sided)]
    outputs = [hits.indices, hits.depths, hits.alphas, hits.weights, hits.transmittance, cut]
    launch(_composite, count, [*inputs, *(as_array(x) for x in outputs)], device)
    chosen = cut.nonzero()[:, 0]
    if len(chosen) == 0:
        return hits
    wider = min(WIDENING * width, len(bvh.surfels))
    return _with_rows(hits, chosen, _cast(bvh, (rays[0][chosen], rays[1][chosen]), nearest, two_sided, wider))


def _with_rows(hits: Hits, chosen: Tensor, wide: Hits) -> Hits:
    """`hits` with the rows `chosen` (C,) replaced by those of `wide`, all as wide as the fullest of them."""
    width = max(int((wide.indices >= 0).sum(dim=1).amax()), hits.indices.shape[1])
    extra = (0, width - hits.indices.shape[1])
    pad = torch.nn.functional.pad
    result = Hits(
        indices=pad(hits.indices, extra, value=-1),
        depths=pad(hits.depths, extra),
        alphas=pad(hits.alphas, extra),
        weights=pad(hits.weights, extra),
        transmittance=hits.transmittance,
    )
    for name in ("indices", "depths", "alphas", "weights"):
        getattr(result, name)[chosen] = getattr(wide, name)[:, :width]
    result.transmittance[chosen] = wide.transmittance
    return result
