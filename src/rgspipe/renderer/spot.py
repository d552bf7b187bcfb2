"""Spot profiles: how a spot's intensity falls with the angle from its axis."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from rgspipe.scene.lights import SpotLight, SpotProfile

#: Keep the angle's derivative finite on the axis, where the angle is wrong by the square root of the first
#: (1e-9 rad), and for a point at the light itself, which has no angle.
_ON_AXIS, _AT_LIGHT = 1e-18, 1e-30


def angle_from_axis(axis: Tensor, towards: Tensor) -> Tensor:
    """(…,) angle in [0, π] between `axis` (3,) and vectors `towards` (…, 3), neither of unit length necessarily.

    By the two-argument arctangent, which is exact near 0 and π where the arccosine loses half of its digits.
    """
    cross = torch.linalg.cross(axis.expand_as(towards), towards)
    across = (cross.square().sum(-1) + _ON_AXIS * towards.square().sum(-1) + _AT_LIGHT).sqrt()
    return torch.atan2(across, towards @ axis)


def spot_profile(profile: SpotProfile, angle: Tensor, cone_angle: float, falloff: float) -> Tensor:
    """Share of the axial intensity at `angle` [rad] from the axis, in [0, 1]; differentiable towards the angle.

    Args:
        profile: `gaussian`: 1 inside cone_angle, exp(−(θ−cone_angle)²/(2·falloff²)) outside, one-sided and exact;
            `smoothstep`: Blender's, smoothstep of (cos θ − cos c)/(falloff·(1 − cos c)), falloff its blend in [0, 1];
            `linear`: Mitsuba's, linear in θ between falloff (its beam angle) and cone_angle (its cutoff).
        cone_angle: half-angle, rad.
        falloff: see `profile`; 0 (for `linear`: cone_angle) makes a hard edge.

    Raises:
        ValueError: the profile has another name, or an angle is out of range.
    """
    if not 0.0 <= cone_angle <= math.pi or falloff < 0.0:
        raise ValueError(f"a spot needs 0 ≤ cone_angle ≤ π and falloff ≥ 0, got {cone_angle} and {falloff}")
    if profile == "gaussian":
        return _gaussian(angle, cone_angle, falloff)
    if profile == "smoothstep":
        return _smoothstep(angle, cone_angle, falloff)
    if profile == "linear":
        width = cone_angle - falloff
        if width <= 0.0:
            return _hard(angle <= cone_angle, angle)
        return ((cone_angle - angle) / width).clamp(0.0, 1.0)
    raise ValueError(f"a spot's profile must be gaussian, smoothstep or linear, got {profile!r}")


def _gaussian(angle: Tensor, cone_angle: float, width: float) -> Tensor:
    outside = (angle - cone_angle).clamp(min=0.0)
    if width == 0.0:
        return _hard(outside <= 0.0, angle)
    # Beyond 40 widths the value is zero in every precision; the clamp keeps its square finite.
    return torch.exp(-0.5 * (outside / width).clamp(max=40.0).square())


def _smoothstep(angle: Tensor, cone_angle: float, blend: float) -> Tensor:
    cosine, edge = torch.cos(angle), math.cos(cone_angle)
    width = blend * (1.0 - edge)
    if width == 0.0:
        return _hard(cosine >= edge, angle)
    y = ((cosine - edge) / width).clamp(0.0, 1.0)
    return y * y * (3.0 - 2.0 * y)


def _hard(inside: Tensor, angle: Tensor) -> Tensor:
    """1 inside, 0 outside, with a derivative of zero."""
    return inside.to(angle) + 0.0 * angle


def spot_share(light: SpotLight, points: Tensor, position: Tensor | None = None, axis: Tensor | None = None) -> Tensor:
    """(N,) share of a spot's axial intensity that goes towards `points` (N, 3).

    Args:
        position, axis: tensors to differentiate towards; by default the light's own.
    """
    position = light.position.to(points) if position is None else position
    axis = light.direction.to(points) if axis is None else axis
    return spot_profile(light.profile, angle_from_axis(axis, points - position), light.cone_angle, light.falloff)


def spot_power(light: SpotLight) -> Tensor:
    """(3,) radiant power [W]: the intensity integrated over all directions, 2π I ∫ p(θ) sin θ dθ."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    kinks = sorted({0.0, *_kinks(light), math.pi})
    total = 0.0
    for low, high in pairwise(kinks):
        angle = torch.from_numpy(0.5 * (high - low) * nodes + 0.5 * (high + low))
        values = spot_profile(light.profile, angle, light.cone_angle, light.falloff) * torch.sin(angle)
        total += 0.5 * (high - low) * float((torch.from_numpy(weights) * values).sum())
    return 2.0 * math.pi * total * light.intensity


def _kinks(light: SpotLight) -> list[float]:
    """Angles where the profile is not smooth, and steps down a Gaussian rim, so that quadrature converges."""
    cone = light.cone_angle
    if light.profile == "gaussian":
        steps = [cone + k * light.falloff for k in (0, 3, 6, 9)]
    elif light.profile == "smoothstep":
        edge = math.cos(cone)
        steps = [cone, math.acos(max(-1.0, min(1.0, edge + light.falloff * (1.0 - edge))))]
    else:
        steps = [light.falloff, cone]
    return [min(max(step, 0.0), math.pi) for step in steps]
