"""Spot profiles: how a spot's intensity falls with the angle from its axis, with derivatives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from rgspipe.scene.lights import SpotLight, SpotProfile

#: Keep the angle's derivative finite on the axis, where the angle is wrong by the square root of the first
#: (1e-9 rad), and for a point at the light itself, which has no angle.
_ON_AXIS, _AT_LIGHT = 1e-18, 1e-30

#: Beyond so many widths of its rim a Gaussian is zero in every precision; the bound keeps the square finite.
_WIDTHS = 40.0


@dataclass(frozen=True)
class SpotShape:
    """What a fit of a spot holds fixed: its profile.

    Attributes:
        profile, cone_angle, falloff: as in `SpotLight`; see `spot_profile`.

    Raises:
        ValueError: an angle is out of range.
    """

    profile: SpotProfile
    cone_angle: float
    falloff: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.cone_angle <= math.pi or not self.falloff >= 0.0:
            found = f"{self.cone_angle} and {self.falloff}"
            raise ValueError(f"a spot needs 0 ≤ cone_angle ≤ π and falloff ≥ 0, got {found}")

    @classmethod
    def of(cls, light: SpotLight) -> SpotShape:
        return cls(light.profile, light.cone_angle, light.falloff)

    def share(self, angle: Tensor) -> Tensor:
        """Share of the axial intensity at `angle` [rad] from the axis."""
        return spot_profile(self.profile, angle, self.cone_angle, self.falloff)[0]


def angle_from_axis(axis: Tensor, towards: Tensor) -> Tensor:
    """(…,) angle in [0, π] between `axis` (…, 3) and vectors `towards` (…, 3), neither of unit length necessarily.

    By the two-argument arctangent, which is exact near 0 and π where the arccosine loses half of its digits.
    """
    a, v = axis.unbind(-1), towards.unbind(-1)
    return torch.atan2(_across(_cross(a, v), v), _dot(a, v))


def angle_slopes(axis: Tensor, towards: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """`angle_from_axis` (…,) and its derivatives (…, 3) towards `towards` and towards `axis`.

    With w = a × v, S = √(|w|² + δ|v|² + ε) and C = a·v the angle is atan2(S, C), so that

        ∂θ/∂v = (C (w × a + δv)/S − S a) / (S² + C²),     ∂θ/∂a = (C (v × w)/S − S v) / (S² + C²).
    """
    # One component after the other, each in one piece of memory, takes a third of the time of rows of three.
    a, v = axis.unbind(-1), towards.movedim(-1, 0).contiguous().unbind(0)
    w = _cross(a, v)
    across, along = _across(w, v), _dot(a, v)
    inverse = 1.0 / (across.square() + along.square())
    outwards, inwards = along / across * inverse, across * inverse
    pairs = zip(_cross(w, a), _cross(v, w), v, a, strict=True)
    slopes = [
        (outwards * (wa + _ON_AXIS * vi) - inwards * ai, outwards * vw - inwards * vi) for wa, vw, vi, ai in pairs
    ]
    by_towards, by_axis = (torch.stack(parts, dim=-1) for parts in zip(*slopes, strict=True))
    return torch.atan2(across, along), by_towards, by_axis


def _cross(a: Sequence[Tensor], b: Sequence[Tensor]) -> list[Tensor]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Sequence[Tensor], b: Sequence[Tensor]) -> Tensor:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _across(cross: Sequence[Tensor], towards: Sequence[Tensor]) -> Tensor:
    """S, never zero."""
    return (_dot(cross, cross) + _ON_AXIS * _dot(towards, towards) + _AT_LIGHT).sqrt()


def spot_profile(
    profile: SpotProfile, angle: Tensor, cone_angle: float | Tensor, falloff: float | Tensor
) -> tuple[Tensor, Tensor]:
    """Share of the axial intensity at `angle` [rad] from the axis, in [0, 1], and its derivative dp/dθ.

    Args:
        profile: `gaussian`: 1 inside cone_angle, exp(−(θ−cone_angle)²/(2·falloff²)) outside, one-sided and exact;
            `smoothstep`: Blender's, smoothstep of (cos θ − cos c)/(falloff·(1 − cos c)), falloff its blend in [0, 1];
            `linear`: Mitsuba's, linear in θ between falloff (its beam angle) and cone_angle (its cutoff).
        cone_angle: half-angle, rad; broadcasts against `angle`.
        falloff: see `profile`; 0 (for `linear`: cone_angle) makes a hard edge, whose derivative counts as 0.

    Raises:
        ValueError: the profile has another name.
    """
    if profile not in _PROFILES:
        raise ValueError(f"a spot's profile must be gaussian, smoothstep or linear, got {profile!r}")
    cone, falloff = (torch.as_tensor(x, dtype=angle.dtype, device=angle.device) for x in (cone_angle, falloff))
    return _PROFILES[profile](angle, cone, falloff)


def _gaussian(angle: Tensor, cone: Tensor, width: Tensor) -> tuple[Tensor, Tensor]:
    outside = (angle - cone).clamp(min=0.0)
    soft, safe = _nonzero(width)
    widths = (outside / safe).clamp(max=_WIDTHS)
    value = torch.exp(-0.5 * widths.square())
    return torch.where(soft, value, (outside <= 0.0).to(angle)), torch.where(soft, -widths / safe * value, 0.0)


def _smoothstep(angle: Tensor, cone: Tensor, blend: Tensor) -> tuple[Tensor, Tensor]:
    # cos θ − cos c = 2 sin((c + θ)/2) sin((c − θ)/2), which keeps its digits in a narrow cone.
    soft, safe = _nonzero(2.0 * blend * torch.sin(0.5 * cone).square())
    y = (2.0 * torch.sin(0.5 * (cone + angle)) * torch.sin(0.5 * (cone - angle)) / safe).clamp(0.0, 1.0)
    value, slope = y * y * (3.0 - 2.0 * y), -6.0 * y * (1.0 - y) * torch.sin(angle) / safe
    return torch.where(soft, value, (angle <= cone).to(angle)), torch.where(soft, slope, 0.0)


def _linear(angle: Tensor, cutoff: Tensor, beam: Tensor) -> tuple[Tensor, Tensor]:
    soft, safe = _nonzero((cutoff - beam).clamp(min=0.0))
    y = (cutoff - angle) / safe
    slope = torch.where((y > 0.0) & (y < 1.0), -1.0 / safe, 0.0)
    return torch.where(soft, y.clamp(0.0, 1.0), (angle <= cutoff).to(angle)), torch.where(soft, slope, 0.0)


_PROFILES = {"gaussian": _gaussian, "smoothstep": _smoothstep, "linear": _linear}


def _nonzero(width: Tensor) -> tuple[Tensor, Tensor]:
    """Where a rim has a width, and the width with 1 where it has none, to divide by."""
    soft = width > 0.0
    return soft, torch.where(soft, width, torch.ones_like(width))


def spot_share(light: SpotLight, points: Tensor, position: Tensor | None = None, axis: Tensor | None = None) -> Tensor:
    """(N,) share of a spot's axial intensity that goes towards `points` (N, 3), differentiable by autograd.

    Args:
        position, axis: tensors to differentiate towards; by default the light's own.
    """
    position = light.position.to(points) if position is None else position
    axis = light.direction.to(points) if axis is None else axis
    return SpotShape.of(light).share(angle_from_axis(axis, points - position))


def spot_power(light: SpotLight) -> Tensor:
    """(3,) radiant power [W]: the intensity integrated over all directions, 2π I ∫ p(θ) sin θ dθ."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    kinks = sorted({0.0, *_kinks(light), math.pi})
    total = 0.0
    for low, high in pairwise(kinks):
        angle = torch.from_numpy(0.5 * (high - low) * nodes + 0.5 * (high + low))
        values = SpotShape.of(light).share(angle) * torch.sin(angle)
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
