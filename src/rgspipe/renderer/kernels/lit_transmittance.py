"""Shadows of a spot, traced only where its light goes: most surfels lie outside its cone."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, launch
from rgspipe.renderer.kernels.places import as_place, way_to
from rgspipe.renderer.kernels.shadow import light_transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, SurfelTree

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Surfels that get less than this share of a spot's axial intensity need no shadow.
LEAST_LIT = 1e-4


@wp.kernel
def _lit_transmittance(
    offset: int,
    slab: int,
    tree: SurfelTree,
    receivers: wp.array(dtype=int),
    light: wp.vec4,
    found: wp.array(dtype=wp.vec4),
):
    item = wp.tid() + offset
    i = receivers[item]
    surfels = tree.records
    d = way_to(light, surfels[i].center)
    passing = float(1.0)
    slope = wp.vec3(0.0, 0.0, 0.0)
    if wp.dot(d, surfels[i].normal) > 0.0 and wp.dot(d, d) > 0.0:
        passing, slope = light_transmittance(tree, i, surfels[i].center, light, d)
    found[item] = wp.vec4(passing, slope[0], slope[1], slope[2])


def lit_transmittance(bvh: SurfelBvh, position: Tensor, lit: Tensor) -> tuple[Tensor, Tensor]:
    """`renderer.pixel_direct.surfel_transmittance` of the surfels that are `lit`; the others get 1, and do not change.

    Args:
        position: (3,) of the light, or its place (4,).
        lit: (N,) bool.

    Returns:
        The transmittance (N,) of the way to each surfel, and its derivative (N, 3) towards the position, float32.
    """
    order = wp.to_torch(bvh.order).long()
    receivers = lit.to(bvh.device)[order].nonzero()[:, 0].int()
    found = torch.empty((len(receivers), 4), dtype=torch.float32, device=bvh.device)
    if len(receivers) > 0:
        inputs = [bvh.tree, as_array(receivers), as_place(bvh, position)]
        launch(_lit_transmittance, len(receivers), [*inputs, wp.from_torch(found, dtype=wp.vec4)], bvh.device)
    passing = torch.ones(len(order), device=bvh.device)
    slope = torch.zeros((len(order), 3), device=bvh.device)
    surfels = order[receivers.long()]
    passing[surfels], slope[surfels] = found[:, 0], found[:, 1:]
    return passing, slope
