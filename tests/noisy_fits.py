"""Searches of the model's own images with noise: what a fit says of a wrong number of lights."""

from __future__ import annotations

import math

import torch

from rgspipe.fitting import FitResult, FitViews, LightSpec
from rgspipe.scene import LightRig
from rgspipe.scene.lights import SpotLight

#: A third place for a light in the lit room.
THIRD = (-0.3, 0.3, 0.1)

SHAPE = SpotLight.shaped("smoothstep", math.radians(30.0), 0.3)


def noisy_images(views: FitViews, rig: LightRig) -> list[torch.Tensor]:
    """The rig's images of the model itself with noise of 2 %."""
    draw = torch.Generator().manual_seed(0)
    return [image + 0.02 * image.mean() * torch.randn(image.shape, generator=draw) for image in views.render(rig)]


def noisy_fit(room, rig: LightRig, spec: LightSpec) -> FitResult:
    """A search for the lights of `noisy_images` in the lit room."""
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=False)
    return views.fit(noisy_images(views, rig))
