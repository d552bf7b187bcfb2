"""Which side of a surfel is its front, from where the cameras stood and what they could see of it."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.progress import progress_bar
from rgspipe.renderer.kernels.irradiance import transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.orientation import backs_towards, turned_over
from rgspipe.scene.surfels import Surfels

#: Viewpoints that are looked from; of more, those that lie farthest from each other.
LOOKED_FROM = 64

#: What a surfel that is hidden from a viewpoint still counts of it, so that one that no camera sees gets a side, too.
HIDDEN_SHARE = 1e-3


def backs_towards_cameras(surfels: Surfels, viewpoints: Tensor) -> Tensor:
    """(N,) bool, surfels whose backs are towards those of the viewpoints (V, 3) that see them.

    As `backs_towards`, each viewpoint weighted by the share of a ray from it that reaches the surfel: occluders are
    two-sided, so the fronts that are looked for do not matter. Fields of view are not looked at: a camera counts as
    if it saw all around. N shadow rays for each of at most `LOOKED_FROM` viewpoints.
    """
    everywhere = torch.ones(len(surfels), dtype=torch.bool, device=surfels.centers.device)
    # Rays go to fronts only, so there is one hierarchy for the surfels as they are and one for their backs.
    sides = SurfelBvh(surfels), SurfelBvh(turned_over(surfels, everywhere))

    def seen(viewpoint: Tensor) -> Tensor:
        reaching = torch.minimum(*(transmittance(side, viewpoint[None])[0][0] for side in sides))
        return reaching.clamp(min=HIDDEN_SHARE).to(surfels.centers)

    chosen = progress_bar(spread_out(viewpoints, LOOKED_FROM), "which side is seen", unit="camera")
    return backs_towards(surfels, chosen, seen)


def spread_out(points: Tensor, count: int) -> Tensor:
    """At most `count` of points (V, 3), far from each other: the first one, then always the farthest from all taken."""
    taken, distance = [0], torch.full((len(points),), torch.inf, dtype=points.dtype)
    for _ in range(min(count, len(points)) - 1):
        distance = torch.minimum(distance, (points - points[taken[-1]]).norm(dim=1))
        taken.append(int(distance.argmax()))
    return points[taken]
