"""Shadows of pixels: shadow rays from a lattice of points in each, so that a shadow's edge is as sharp as the image."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, launch
from rgspipe.renderer.kernels.pixel_light import point_on_surfel
from rgspipe.renderer.kernels.pixel_rays import PixelRays
from rgspipe.renderer.kernels.places import as_place, way_to
from rgspipe.renderer.kernels.shadow import light_transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, SurfelTree

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})


@wp.kernel
def _pixel_transmittance(
    offset: int,
    slab: int,
    tree: SurfelTree,
    rays: PixelRays,
    places: wp.array(dtype=wp.vec2),
    pixels: wp.array(dtype=int),
    receivers: wp.array(dtype=int),
    light: wp.vec4,
    parts: int,
    found: wp.array(dtype=wp.vec4),
):
    item = wp.tid() + offset
    p = pixels[item / parts]
    i = receivers[p]
    n = tree.records[i].normal
    total = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for k in range(item % parts, places.shape[0], parts):
        d = rays.directions[p] + (places[k][0] - 0.5) * rays.right + (places[k][1] - 0.5) * rays.up
        at = point_on_surfel(rays.origin, d, tree.records[i].center, n, 1.0e30)
        path = way_to(light, at)
        if wp.dot(path, n) > 0.0:
            passing, slope = light_transmittance(tree, i, at, light, path)
            total += wp.vec4(passing, slope[0], slope[1], slope[2])
    found[item] = total / float(places.shape[0])


def pixel_transmittance(
    bvh: SurfelBvh, rays: PixelRays, receivers: Tensor, pixels: Tensor, light: Tensor, places: Tensor
) -> Tensor:
    """(P, 4) part of a light that reaches each pixel's surface, its mean over the pixel, and d/d(light) of it.

    Args:
        rays: of P pixels.
        receivers: (P,) int64 surfel that stands for the surface in each pixel.
        pixels: (K,) int64 those that are computed; that of the others is −1.
        light: (3,) position, or (4,) place.
        places: (K, 2) of a pixel's shadow rays in the unit square.
    """
    transmittance = torch.full((len(receivers), 4), -1.0, dtype=torch.float32, device=bvh.device)
    if len(pixels) == 0:
        return transmittance
    # On a GPU an item is a ray, as the few pixels on shadows' edges do not fill it; on a CPU it is a pixel, as an item
    # costs more there than a round of a loop.
    parts = 1 if bvh.device.type == "cpu" else len(places)
    found = torch.empty((len(pixels), parts, 4), dtype=torch.float32, device=bvh.device)
    lattice = wp.from_torch(places.float().contiguous().to(bvh.device), dtype=wp.vec2)
    records = wp.to_torch(bvh.rank)[receivers.to(bvh.device)].int()
    pixels = pixels.to(bvh.device)
    which = [as_array(pixels.int()), as_array(records), as_place(bvh, light), parts]
    inputs = [bvh.tree, rays, lattice, *which, wp.from_torch(found.reshape(-1, 4), dtype=wp.vec4)]
    launch(_pixel_transmittance, len(pixels) * parts, inputs, bvh.device)
    transmittance[pixels] = found.sum(dim=1)
    return transmittance
