"""The room of `lit_room` without the wall at −y, or with a hole in it, and images with light from all around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import torch

from lit_room import room_surfels
from rgspipe.renderer.ambient import ambient_image
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, LightRig, Surfels, look_at

#: The colour of the light from outside.
TINT = torch.tensor([1.0, 0.9, 1.2])


def open_surfels() -> Surfels:
    """1076 surfels; 18 % of what they look at is void."""
    surfels = room_surfels()
    kept = surfels.centers[:, 1] > -0.499
    return replace(surfels, **{name: value[kept] for name, value in surfels.tensors().items()})


def frozen_hole() -> FrozenScene:
    """The room with four surfels of that wall missing, through which 0.2 % of what arrives could come."""
    surfels = room_surfels()
    hole = (surfels.centers[:, 1] < -0.499) & (surfels.centers[:, [0, 2]].abs() < 0.06).all(dim=1)
    kept = replace(surfels, **{name: value[~hole] for name, value in surfels.tensors().items()})
    return FrozenScene.freeze(kept, gather_rays=64, patches=150, seed=0).with_dictionary(6)


@cache
def frozen_open_room() -> FrozenScene:
    return FrozenScene.freeze(open_surfels(), gather_rays=64, patches=150, seed=0).with_dictionary(6)


def open_room_cameras(resolution: int) -> list[Camera]:
    """Two cameras in the room, as those of the closed one, and one that looks in from outside."""
    origins = torch.tensor([[-0.4, -0.4, 0.3], [-0.42, -0.1, 0.25], [0.0, -0.9, 0.1]])
    aim = torch.tensor([0.1, 0.1, -0.1])
    return [Camera.from_field_of_view(look_at(origin, aim), 1.4, resolution, resolution) for origin in origins]


def radiance_for(frozen: FrozenScene, views: Sequence[ViewWeights], rig: LightRig, share: float) -> torch.Tensor:
    """(3,) radiance of the void, of colour TINT, that sends `share` of all light in the images."""
    lit = sum(float(frozen.render(view, rig, sharp=False).sum()) for view in views)
    unit = sum(float((TINT * ambient_image(frozen, view)).sum()) for view in views)
    return share / (1.0 - share) * lit / unit * TINT


def lit_images(
    frozen: FrozenScene, views: Sequence[ViewWeights], rig: LightRig, radiance: torch.Tensor, noise: float = 0.0
) -> list[torch.Tensor]:
    """Images of the model itself under a rig and the void, with noise of this part of each one's mean."""
    draw = torch.Generator().manual_seed(1)
    images = [frozen.render(view, rig, sharp=False) + radiance * ambient_image(frozen, view) for view in views]
    return [(image + noise * image.mean() * torch.randn(image.shape, generator=draw)).clamp(min=0) for image in images]
