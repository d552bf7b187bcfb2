"""How much of a scene's surroundings its surfaces see: nothing in a closed room, nearly all around an object."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.machine.sums import average
from rgspipe.progress import progress_bar
from rgspipe.renderer.gather import LIFT, RAYS_AT_ONCE
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.point_sets import cosine_directions
from rgspipe.renderer.rays import SURFACE_SHARE
from rgspipe.renderer.transport import PatchTransport
from rgspipe.renderer.view_weights import nearest_hit
from rgspipe.scene.surfels import Surfels

#: Surfels that look around, and rays of each: the share is known to a few percent, in milliseconds.
LOOKING, RAYS = 256, 32

#: Rays of every surfel where light from the void is to be known surfel by surfel.
VOID_RAYS = 256


def openness(bvh: SurfelBvh, surfels: Surfels) -> float:
    """Share in [0, 1] of cosine-weighted directions from the surfels' fronts that leave the scene.

    Args:
        bvh: the hierarchy over `surfels`.
        surfels: at the places that `bvh` was given; their order is not looked at.
    """
    count = len(surfels)
    if count == 0:
        return 1.0
    chosen = torch.linspace(0, count - 1, min(LOOKING, count)).round().long()
    directions = cosine_directions(surfels.frames[chosen], RAYS, torch.Generator().manual_seed(0))
    directions = directions.reshape(-1, 3)
    origins = surfels.centers[chosen].repeat_interleave(RAYS, dim=0)
    return float(average(composite(bvh, origins, directions).transmittance))


def void_irradiance(bvh: SurfelBvh, rays: int = VOID_RAYS, *, seed: int = 0) -> Tensor:
    """(N,) float32 irradiance of every surfel from a void of radiance 1 all around: π where nothing is in the way.

    E_i = π · the mean over cosine-distributed directions of what passes all surfels, whose backs stop light as their
    fronts do. Rays that meet a surface are stopped by all of it: what leaks past one is noise of the representation.

    Args:
        rays: of every surfel; with 256 E is known to 0.4 % of that of an open plane (root mean square, a Cornell box).
        seed: of the rays.
    """
    surfels, generator = bvh.surfels, torch.Generator().manual_seed(seed)
    axes = surfels.frames
    lifted = surfels.centers + LIFT * surfels.scales.prod(dim=1).sqrt()[:, None] * axes[:, 2]
    parts = [torch.zeros(0, device=bvh.device)]
    pairs = list(zip(*(part.split(max(1, RAYS_AT_ONCE // rays)) for part in (axes, lifted)), strict=True))
    for frames, origins in progress_bar(pairs, "light from outside", unit="batch"):
        directions = cosine_directions(frames.float(), rays, generator)
        from_there = origins[:, None].expand_as(directions).reshape(-1, 3)
        hits = composite(bvh, from_there, directions.reshape(-1, 3), nearest_hit(bvh), two_sided=True)
        passing = torch.where(hits.transmittance < 1.0 - SURFACE_SHARE, 0.0, hits.transmittance)
        parts.append(math.pi * passing.reshape(-1, rays).mean(dim=1))
    return torch.cat(parts)


def rough_void_irradiance(transport: PatchTransport) -> Tensor:
    """(N,) `void_irradiance` without a ray: π times what the rows of the gather, of fronts alone, lack to 1."""
    seen = transport.gather @ torch.ones(transport.gather.shape[1], 1, device=transport.albedo.device)
    return math.pi * (1.0 - seen[:, 0]).clamp(min=0.0)
