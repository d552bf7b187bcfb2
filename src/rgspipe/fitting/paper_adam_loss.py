"""What the published method minimises: its loss of the images of a rig, differentiable towards all that moves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from rgspipe.fitting.parameters import Emitter
from rgspipe.fitting.problem import Effects
from rgspipe.fitting.schedule import soft
from rgspipe.fitting.spot_harmonics import BandLimit, fitted_share
from rgspipe.fitting.ssim import ssim
from rgspipe.fitting.views import PreparedViews
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


def adam_loss(views: PreparedViews, target: Tensor, rig: MovingRig, ssim_weight: float, effects: Effects) -> Tensor:
    """(1−λ)·mean|M⊙(I − I*)| + λ·(1 − SSIM(M⊙I, M⊙I*)), averaged over the views.

    Args:
        target: (all pixels, 3), the views' images stacked.
        ssim_weight: λ.
    """
    stacked = rig_image(views, rig, effects)
    losses, start = [], 0
    for view, mask in zip(views.views, views.masks, strict=True):
        pixels = slice(start, start + view.camera.pixel_count)
        start = pixels.stop
        shape = (view.camera.height, view.camera.width, 3)
        covered = mask.to(stacked)[:, :, None]
        image, wanted = covered * stacked[pixels].reshape(shape), covered * target[pixels].reshape(shape)
        absolute = (image - wanted).abs().mean()
        losses.append((1.0 - ssim_weight) * absolute + ssim_weight * (1.0 - ssim(image, wanted)))
    return torch.stack(losses).mean()
