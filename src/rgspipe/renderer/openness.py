"""How much of a scene's surroundings its surfaces see: nothing in a closed room, nearly all around an object."""

from __future__ import annotations

import torch

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.point_sets import cosine_directions
from rgspipe.scene.surfels import Surfels
from rgspipe.sums import average

#: Surfels that look around, and rays of each: the share is known to a few percent, in milliseconds.
LOOKING, RAYS = 256, 32


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
