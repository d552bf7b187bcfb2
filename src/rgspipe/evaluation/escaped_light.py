"""Light that leaves a room where no camera saw a way out: what is there is not known, and nothing stands for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.point_sets import cosine_directions
from rgspipe.renderer.surroundings import OPEN
from rgspipe.scene.camera import Camera

#: Surfels that look around, and rays of each: a share is known to a percent, in milliseconds.
LOOKING, RAYS = 256, 32

#: A ray leaves the scene if so much of its light does: less passes between surfels where walls meet.
LEAVES = 0.5


@dataclass(frozen=True)
class Escaped:
    """Light that is missing.

    Attributes:
        places: (P, 3) float64 where rays leave the box around surfels and cameras, in places that no camera saw.
        shares: (P,) float64 of what surfaces look at; their sum is what is missing.
    """

    places: Tensor
    shares: Tensor


def escaped_light(frozen: FrozenScene, cameras: Sequence[Camera]) -> Escaped:
    """What surfaces would receive light from, if something were there, and what no camera looked through.

    Rows of the gather operator that sum to less than 1 lose light. An open front is no loss: there a camera saw that
    nothing is. Around an object in empty space nothing is missing.

    Args:
        frozen: the scene; only its surfels that some camera saw look around.
        cameras: those that saw it.
    """
    seen = (frozen.surfels.guessed == 0.0).nonzero()[:, 0].cpu()
    if not len(seen) or not cameras or frozen.openness > OPEN:
        return Escaped(torch.zeros(0, 3, dtype=torch.float64), torch.zeros(0, dtype=torch.float64))
    chosen = seen[torch.linspace(0, len(seen) - 1, min(LOOKING, len(seen))).round().long()]
    surfels = frozen.surfels.to("cpu")
    origins = (surfels.centers if frozen.centers is None else frozen.centers.cpu())[chosen].double()
    directions = cosine_directions(surfels.frames[chosen], RAYS, torch.Generator().manual_seed(0)).reshape(-1, 3)
    origins, directions = origins.repeat_interleave(RAYS, dim=0), directions.double()
    area = frozen.areas.cpu().double()[chosen].repeat_interleave(RAYS)
    leaving = composite(frozen.bvh, origins, directions).transmittance.cpu().double()
    out = leaving > LEAVES
    places = _exits(origins[out], directions[out], surfels.centers.double(), cameras)
    missing = ~_are_seen(frozen, places, cameras)
    return Escaped(places[missing], (leaving * area)[out][missing] / area.sum().clamp(min=1e-300))


def _exits(origins: Tensor, directions: Tensor, centers: Tensor, cameras: Sequence[Camera]) -> Tensor:
    """(R, 3) where rays leave the box around surfels and cameras."""
    held = torch.cat([centers, torch.stack([camera.origin.double().cpu() for camera in cameras])])
    side = torch.where(directions > 0.0, held.amax(dim=0), held.amin(dim=0))
    reach = ((side - origins) / directions).nan_to_num(nan=torch.inf).clamp(min=0.0).amin(dim=1)
    return origins + reach[:, None] * directions


def _are_seen(frozen: FrozenScene, places: Tensor, cameras: Sequence[Camera]) -> Tensor:
    """(P,) bool: whether a camera saw as far as each of `places` (P, 3)."""
    seen = torch.zeros(len(places), dtype=torch.bool)
    for camera in cameras:
        hidden = (~seen).nonzero()[:, 0]
        pixel, depth = camera.project(places[hidden])
        framed = (depth > 0.0) & (pixel >= 0.0).all(dim=1) & (pixel[:, 0] < camera.width)
        asked = hidden[framed & (pixel[:, 1] < camera.height)]
        if len(asked):
            seen[asked] = _in_sight(frozen, camera, places[asked])
    return seen


def _in_sight(frozen: FrozenScene, camera: Camera, places: Tensor) -> Tensor:
    """(P,) bool: whether less than half is hidden of what a camera sees at `places` (P, 3)."""
    origin = camera.origin.double().cpu()
    away = places - origin
    distance = away.norm(dim=1, keepdim=True).clamp(min=1e-12)
    hits = composite(frozen.bvh, origin.expand_as(places), away / distance, two_sided=True)
    # A wall that stands there does not hide itself.
    before = hits.depths.cpu() < distance - frozen.surfels.coverage.layer_thickness
    return (hits.weights.cpu() * before).sum(dim=1) < 0.5
