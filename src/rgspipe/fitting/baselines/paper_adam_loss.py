"""What the published method minimises: its loss of the images of a rig, differentiable towards all that moves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from rgspipe.fitting.model.parameters import Emitter
from rgspipe.fitting.model.problem import Effects
from rgspipe.fitting.model.spot_harmonics import BandLimit, fitted_share
from rgspipe.fitting.model.views import PreparedViews
from rgspipe.fitting.search.schedule import soft
from rgspipe.optim.ssim_reference import SsimReference
from rgspipe.renderer.direct import differentiable_irradiance
from rgspipe.renderer.spot import SpotShape
from rgspipe.scene import LightRig


@dataclass(frozen=True)
class MovingRig:
    """L lights of one type as tensors, each of which may require gradients.

    Attributes:
        positions: (L, 3) scene units.
        log_intensities: (L, 3) of W/sr.
        axes: (L, 3) of spots, of unit length; None for point lights.
        shape: the spots' profile, the same for all; None for point lights.
    """

    positions: Tensor
    log_intensities: Tensor
    axes: Tensor | None = None
    shape: SpotShape | None = None

    def emitters(self) -> tuple[Emitter, ...]:
        """The lights without intensity and gradients; a rim without width gets the width that fits take it with."""
        positions = self.positions.detach().clone()
        if self.axes is None:
            return tuple(Emitter(position) for position in positions)
        axes = self.axes.detach().clone()
        return soft(tuple(Emitter(*both, self.shape) for both in zip(positions, axes, strict=True)), 0.0)

    def lights(self) -> LightRig:
        """The lights, without gradients."""
        intensities = self.log_intensities.detach().exp()
        return tuple(one.light(intensity) for one, intensity in zip(self.emitters(), intensities, strict=True))


class _Share(torch.autograd.Function):
    """The share of a spot's light towards points, differentiable towards its position and axis."""

    @staticmethod
    def forward(
        ctx: Any, position: Tensor, axis: Tensor, points: Tensor, emitter: Emitter, band: BandLimit | None
    ) -> Tensor:
        spot = position.detach(), axis.detach(), emitter.shape, emitter.softness
        share = fitted_share(points, *spot, band, emitter.cone_free)
        ctx.save_for_backward(share.by_position, share.by_axis)
        ctx.like = position.dtype, position.device
        return share.value

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        dtype, device = ctx.like
        by_position, by_axis = (slope.T @ gradient for slope in ctx.saved_tensors)
        return by_position.to(device, dtype), by_axis.to(device, dtype), None, None, None


def rig_image(views: PreparedViews, rig: MovingRig, effects: Effects) -> Tensor:
    """(all pixels, 3) float32 images of a rig, stacked: direct light at surfels' centres, lobes of gloss left out.

    The lights are added up before their light bounces, so a rig costs as many bounces as one light.
    """
    frozen = views.frozen
    lit = differentiable_irradiance(frozen.bvh, rig.positions, effects.shadows)
    if rig.axes is not None:
        points = frozen.bvh.surfels.centers
        spots = zip(rig.positions, rig.axes, rig.emitters(), strict=True)
        lit = lit * torch.stack([_Share.apply(*spot[:2], points, spot[2], effects.spots) for spot in spots])
    irradiance = lit.T @ rig.log_intensities.exp().to(lit)
    radiance = frozen.surfels.albedo * (irradiance / math.pi)
    if effects.interreflection:
        radiance = radiance + frozen.indirect(radiance[:, :, None])[:, :, 0]
    return views.all_pixels @ radiance


class AdamLoss:
    """(1−λ)·mean|M⊙(I − I*)| + λ·(1 − SSIM(M⊙I, M⊙I*)), averaged over the views, as a function of the rig.

    Args:
        target: (all pixels, 3), the views' images stacked.
        ssim_weight: λ.
    """

    def __init__(self, views: PreparedViews, target: Tensor, ssim_weight: float, effects: Effects) -> None:
        self._views, self._weight, self._effects = views, ssim_weight, effects
        self._covered = [mask.to(target)[:, :, None] for mask in views.masks]
        wanted = [mask * image for mask, image in zip(self._covered, views.split_images(target), strict=True)]
        self._wanted = [(image, SsimReference.of(image)) for image in wanted]

    def __call__(self, rig: MovingRig) -> Tensor:
        images = self._views.split_images(rig_image(self._views, rig, self._effects))
        losses = []
        for image, mask, (wanted, reference) in zip(images, self._covered, self._wanted, strict=True):
            image = mask * image
            absolute = (image - wanted).abs().mean()
            losses.append((1.0 - self._weight) * absolute + self._weight * (1.0 - reference.similarity(image)))
        return torch.stack(losses).mean()
