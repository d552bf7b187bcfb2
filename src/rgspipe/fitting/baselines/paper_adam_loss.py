"""What the published method minimises: its loss of the images of a rig, differentiable towards all that moves."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.views import PreparedViews
from rgspipe.fitting.search.schedule import soft
from rgspipe.machine.sums import average
from rgspipe.optim.ssim_reference import SsimReference
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.lit_surfels import lit_surfels
from rgspipe.renderer.rig import RigResponse
from rgspipe.renderer.unit_light import OwnLight
from rgspipe.scene import Light, LightRig


@dataclass(frozen=True)
class MovingRig:
    """L lights of one type as tensors, each of which may require gradients.

    Attributes:
        positions: (L, 3) scene units.
        log_intensities: (L, 3) of W/sr.
        shape: a light of their kind and shape, wherever it is.
        axes: (L, 3) of unit length; None where they shine alike in all directions.
    """

    positions: Tensor
    log_intensities: Tensor
    shape: Light
    axes: Tensor | None = None

    def emitters(self) -> tuple[Emitter, ...]:
        """The lights without intensity and gradients; a rim without width gets the width that fits take it with."""
        positions = self.positions.detach().clone()
        axes = [None] * len(positions) if self.axes is None else self.axes.detach().clone()
        lights = (self.shape.at(*both) for both in zip(positions, axes, strict=True))
        return soft(tuple(map(Emitter.of, lights)), 0.0)

    def moving(self) -> tuple[OwnLight, ...]:
        """The lights with their gradients, and with the rims of `emitters`."""
        axes = [None] * len(self.positions) if self.axes is None else self.axes
        parts = zip(self.positions, axes, self.log_intensities.exp(), self.emitters(), strict=True)
        return tuple(OwnLight(self.shape.at(*tensors), emitter.softness) for *tensors, emitter in parts)

    def lights(self) -> LightRig:
        """The lights, without gradients."""
        intensities = self.log_intensities.detach().exp()
        return tuple(one.shining(intensity) for one, intensity in zip(self.emitters(), intensities, strict=True))


def rig_image(views: PreparedViews, rig: MovingRig, effects: Effects) -> Tensor:
    """(all pixels, 3) float32 images of a rig, stacked: direct light at surfels' centres, lobes of gloss left out.

    The lights are added up before their light bounces, so a rig costs as many bounces as one light.
    """
    frozen, moving = views.frozen, rig.moving()
    lit = [lit_surfels(frozen.bvh, light, effects, 0.0) for light in moving]
    response = RigResponse.of(frozen.bvh, tuple(light.given for light in moving), lit)
    return views.every_pixel.operator @ frozen.coloured_radiance(response.summed(), effects.interreflection)


class AdamLoss:
    """(1−λ)·mean|M⊙(I − I*)| + λ·(1 − SSIM(M⊙I, M⊙I*)), averaged over the views, as a function of the rig.

    Args:
        target: (all pixels, 3), the views' images stacked.
        ssim_weight: λ.
    """

    def __init__(self, views: PreparedViews, target: Tensor, ssim_weight: float, effects: Effects) -> None:
        self._views, self._weight, self._effects = views, ssim_weight, effects
        self._covered = [mask.to(target)[:, :, None] for mask in views.masks]
        wanted = [mask * image for mask, image in zip(self._covered, views.split(target), strict=True)]
        self._wanted = [(image, SsimReference.of(image)) for image in wanted]

    def __call__(self, rig: MovingRig) -> Tensor:
        images = self._views.split(rig_image(self._views, rig, self._effects))
        losses = []
        for image, mask, (wanted, reference) in zip(images, self._covered, self._wanted, strict=True):
            image = mask * image
            absolute = average((image - wanted).abs())
            losses.append((1.0 - self._weight) * absolute + self._weight * (1.0 - reference.similarity(image)))
        return torch.stack(losses).mean()
