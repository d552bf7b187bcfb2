"""What share of a spot's light goes towards points, with derivatives towards all that a fit may move."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.spot import SpotShape, angle_slopes, spot_profile
from rgspipe.scene.lights import SpotProfile

#: A Gaussian falls to one half at so many of its standard deviations.
HALF_WIDTHS = math.sqrt(2.0 * math.log(2.0))


@dataclass(frozen=True)
class SpotShare:
    """Share p of a spot's axial intensity towards N points, and its derivatives.

    Attributes:
        value: (N,) p.
        by_position: (N, 3) towards the spot's position, per scene unit.
        by_axis: (N, 3) towards its axis of unit length; across the axis only.
        by_cone: (N,) towards its cone angle, per rad; None if not asked for.
        by_falloff: (N,) towards its falloff, in the falloff's own unit; None if not asked for.
    """

    value: Tensor
    by_position: Tensor
    by_axis: Tensor
    by_cone: Tensor | None
    by_falloff: Tensor | None


def spot_share_slopes(
    points: Tensor, position: Tensor, axis: Tensor, shape: SpotShape, softness: float = 0.0, cone_free: bool = True
) -> SpotShare:
    """`SpotShare` of one spot, float32.

    Args:
        points: (N, 3) float64; the difference from the light is taken in float64, as float32 knows neither of the two
            well enough far from the origin.
        position, axis: (3,) of the spot, away from it.
        shape: its profile.
        softness: widens the rim by so much [rad]; see `softened`.
        cone_free: whether derivatives towards cone angle and falloff are wanted, which take half of the time.
    """
    towards = (points.double() - position.to(points.device, torch.float64)).float()
    unit = torch.nn.functional.normalize(axis.to(towards), dim=0)[None]
    angle, by_towards, by_axis = angle_slopes(unit, towards)
    # One cone for all points, or one each where every point has a derivative of its own.
    extent = angle.shape if cone_free else ()
    cone, falloff = (torch.full(extent, x).to(angle) for x in (shape.cone_angle, shape.falloff))
    with torch.set_grad_enabled(cone_free):
        profile, *rim = softened(
            shape.profile, cone.requires_grad_(cone_free), falloff.requires_grad_(cone_free), softness
        )
        value, slope = spot_profile(profile, angle, *rim)
    by_cone, by_falloff = _towards_cone(value, cone, falloff) if cone_free else (None, None)
    value, slope = value.detach(), slope.detach()[:, None]
    return SpotShare(value, -slope * by_towards, slope * by_axis, by_cone, by_falloff)


def _towards_cone(value: Tensor, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
    """Derivatives (N,) of shares (N,) towards their own cone angles and falloffs (N,)."""
    slopes = torch.autograd.grad(value.sum(), (cone, falloff), allow_unused=True)
    by_cone, by_falloff = (torch.zeros_like(value) if slope is None else slope for slope in slopes)
    return by_cone, by_falloff


def softened(profile: SpotProfile, cone: Tensor, falloff: Tensor, width: float) -> tuple[SpotProfile, Tensor, Tensor]:
    """A profile with a rim that is wider by `width` [rad], as profile, cone angle and falloff; itself for 0.

    A narrow rim says where it is only to lights that almost hit the right place. The wider one is a Gaussian that
    falls to one half at the same angle (unless it is wider than the cone itself).
    """
    if width == 0.0:
        return profile, cone, falloff
    half, sigma = _half_angle_and_width(profile, cone, falloff)
    wide = (sigma.square() + width**2).sqrt()
    return "gaussian", (half - HALF_WIDTHS * wide).clamp(min=0.0), wide


def _half_angle_and_width(profile: SpotProfile, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
    """Angle at which a profile has fallen to one half, and the standard deviation of a Gaussian rim like its own."""
    if profile == "gaussian":
        return cone + HALF_WIDTHS * falloff, falloff
    if profile == "linear":
        full = torch.minimum(falloff, cone)
        half = 0.5 * (full + cone)
    else:
        share = falloff.clamp(0.0, 1.0) * (1.0 - torch.cos(cone))
        full, half = (torch.acos((torch.cos(cone) + part * share).clamp(-1.0, 1.0 - 1e-7)) for part in (1.0, 0.5))
    return half, (half - full).clamp(min=0.0) / HALF_WIDTHS


def rim_width(shape: SpotShape) -> float:
    """Standard deviation [rad] of a Gaussian rim like the profile's; 0 for a hard edge."""
    cone, falloff = (torch.tensor(x, dtype=torch.float64) for x in (shape.cone_angle, shape.falloff))
    return float(_half_angle_and_width(shape.profile, cone, falloff)[1])
