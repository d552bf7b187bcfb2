"""Places of lights in homogeneous coordinates: a light at infinity is one of them, and needs no kernel of its own.

A place (x, y, z, w) is the point (x, y, z)/w; with w = 0 it is infinitely far away in the direction (x, y, z). The way
from a point c to it is (x, y, z) − w·c, for w = 1 to the light itself, for w = 0 the same direction everywhere.
"""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})


@wp.func
def way_to(light: wp.vec4, at: wp.vec3):
    """From a point to a light: in scene units, or a unit vector to one at infinity."""
    return wp.vec3(light[0], light[1], light[2]) - light[3] * at


def homogeneous(places: Tensor) -> Tensor:
    """(…, 4) places from points (…, 3); places stay what they are."""
    if places.shape[-1] == 4:
        return places
    return torch.cat([places, torch.ones_like(places[..., :1])], dim=-1)


def ways_to(places: Tensor, points: Tensor) -> Tensor:
    """(N, 3) `way_to` a place (3,) or (4,) from points (N, 3), in float64: far from the origin float32 knows too few
    digits of either."""
    place = homogeneous(places).to(points.device, torch.float64)
    return place[:3] - place[3] * points.double()


def local_places(bvh: SurfelBvh, places: Tensor) -> Tensor:
    """(…, 4) float32 `homogeneous` places (…, 3) or (…, 4), from the scene's middle, contiguous, on its device."""
    places = homogeneous(places).detach().to(bvh.device, torch.float64)
    return torch.cat([places[..., :3] - places[..., 3:] * bvh.middle, places[..., 3:]], dim=-1).float().contiguous()


def as_places(bvh: SurfelBvh, places: Tensor) -> wp.array:
    """(L,) `local_places` as an array of vec4."""
    return wp.from_torch(local_places(bvh, places), dtype=wp.vec4)


def as_place(bvh: SurfelBvh, place: Tensor) -> wp.vec4:
    """`local_places` of one light as a vec4."""
    return wp.vec4(*local_places(bvh, place).cpu().tolist())
