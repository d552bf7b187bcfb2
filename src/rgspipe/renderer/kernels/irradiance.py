"""Irradiance of point lights on every surfel and its derivative, shadows included, in one pass."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch
from rgspipe.renderer.kernels.places import as_places, way_to
from rgspipe.renderer.kernels.shadow import light_transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, SurfelTree

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Within this many of its scales a surfel sees a light as if it were farther away: inside a surfel the inverse
#: square has no meaning, and its derivative would grow without bound.
SOFTENING = wp.constant(0.5)


@wp.kernel
def _irradiance(
    offset: int,
    slab: int,
    tree: SurfelTree,
    receivers: wp.array(dtype=int),
    places: wp.array(dtype=int),
    lights: wp.array(dtype=wp.vec4),
    falloff: int,
    shadows: int,
    irradiance: wp.array(dtype=float),
    derivative: wp.array(dtype=wp.vec3),
):
    item = wp.tid() + offset
    surfels = tree.records
    count = receivers.shape[0]
    light = lights[item / count]
    k = item % count
    i = receivers[k]
    n = surfels[i].normal
    d = way_to(light, surfels[i].center)
    projected = wp.dot(d, n)
    value = 1.0 - float(falloff)
    slope = wp.vec3(0.0, 0.0, 0.0)
    if projected >= 0.0:  # the derivative at a light in the plane is that towards the lit side
        square = wp.dot(d, d)
        if falloff == 1:
            # √(|d|⁴ + ε⁴), without squares that leave float32's range; nothing is near a light at infinity.
            softening = light[3] * SOFTENING * surfels[i].scale
            larger = wp.max(square, softening * softening)
            ratio = wp.min(square, softening * softening) / larger
            softened = larger * wp.sqrt(1.0 + ratio * ratio)
            inverse_cube = 1.0 / (softened * wp.sqrt(softened))
            value = projected * inverse_cube
            slope = inverse_cube * (n - (3.0 * projected * (square / softened) / softened) * d)
        if shadows == 1 and projected > 0.0 and square > 0.0:
            passing, passing_slope = light_transmittance(tree, i, surfels[i].center, light, d)
            slope = passing * slope + value * passing_slope
            value *= passing
    place = item - k + places[k]
    irradiance[place] = value
    derivative[place] = slope


def point_irradiance(
    bvh: SurfelBvh, positions: Tensor, shadows: bool, at: Tensor | None = None
) -> tuple[Tensor, Tensor]:
    """Irradiance (L, N) of unit lights at (L, 3) or places (L, 4), and its derivative (L, N, 3) towards x, y and z.

    Without shadows the hierarchy is neither built nor read. N are all surfels, or those `at` (N,).
    """
    return _launch(bvh, positions, at, falloff=True, shadows=shadows)


def transmittance(bvh: SurfelBvh, positions: Tensor) -> tuple[Tensor, Tensor]:
    """Transmittance (L, N) from lights at (L, 3) or places (L, 4) to each surfel, and its derivative (L, N, 3).

    Occluders are two-sided. Surfels that face away from the light get 1: their irradiance is zero by the cosine.
    """
    return _launch(bvh, positions, None, falloff=False, shadows=True)


def _launch(
    bvh: SurfelBvh, positions: Tensor, at: Tensor | None, *, falloff: bool, shadows: bool
) -> tuple[Tensor, Tensor]:
    receivers, places = _receivers(bvh, at)
    lights, count = positions.shape[0], len(receivers)
    value = torch.empty((lights, count), dtype=torch.float32, device=bvh.device)
    derivative = torch.empty((lights, count, 3), dtype=torch.float32, device=bvh.device)
    if count > 0:
        tree = bvh.tree if shadows else bvh.leaves
        inputs = [tree, as_array(receivers), as_array(places), as_places(bvh, positions)]
        outputs = [as_array(value.view(-1)), as_vec3(derivative.view(-1, 3))]
        inputs += [int(falloff), int(shadows), *outputs]
        launch(_irradiance, lights * count, inputs, bvh.device, even=not shadows)
    return value, derivative


def _receivers(bvh: SurfelBvh, at: Tensor | None) -> tuple[Tensor, Tensor]:
    """(N,) int32 records that light falls on, neighbours after each other, and where each one's value belongs."""
    if at is None:
        return torch.arange(len(bvh.surfels), dtype=torch.int32, device=bvh.device), wp.to_torch(bvh.order)
    records, places = wp.to_torch(bvh.rank)[at.to(bvh.device)].sort()
    return records, places.int()
