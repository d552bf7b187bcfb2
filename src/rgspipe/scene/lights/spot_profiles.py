"""How a spot's intensity falls with the angle from its axis: the profiles of other programs, with derivatives.

Each is a function of the angle θ, a cone angle c and a falloff, which means something else in each. A falloff of 0 (of
a linear profile: of the cone angle) makes a hard edge, whose derivative counts as 0.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import torch
from torch import Tensor

#: Beyond so many widths of its rim a Gaussian is zero in every precision; the bound keeps the square finite.
_WIDTHS = 40.0

#: A Gaussian falls to one half at so many of its standard deviations.
HALF_WIDTHS = math.sqrt(2.0 * math.log(2.0))

#: A Gaussian rim is integrated in steps of so many standard deviations, up to where it is zero in every precision.
_STEPS = (0.0, 3.0, 6.0, 9.0)


class Profile(ABC):
    """One way in which intensity falls.

    Attributes:
        name: in files and settings.
        falloff_key, falloff_unit: what its falloff is called in files, and its unit for people.
    """

    name: ClassVar[str]
    falloff_key: ClassVar[str]
    falloff_unit: ClassVar[str] = "°"

    @abstractmethod
    def __call__(self, angle: Tensor, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        """Relative intensity at `angle`, in [0, 1], and its derivative dp/dθ."""

    @abstractmethod
    def half_and_width(self, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        """Angle where it has fallen to one half, and the standard deviation of a Gaussian rim like its own."""

    @abstractmethod
    def kinks(self, cone: float, falloff: float) -> list[float]:
        """Angles between which it is smooth."""

    @abstractmethod
    def largest_falloff(self, cone: float) -> float:
        """The widest rim that a cone of this angle can have."""

    @abstractmethod
    def emission(self, maths: Any, cosine: Any, cone: float, falloff: float) -> Any:
        """See `Light.emission`."""

    def falloff_with(self, cone: float, falloff: float, changed: float) -> float:
        """The falloff after the cone angle became `changed`."""
        return falloff


class Gaussian(Profile):
    """1 inside the cone, exp(−(θ−c)²/(2·falloff²)) outside, one-sided and exact."""

    name = "gaussian"
    falloff_key = "falloff"

    def __call__(self, angle: Tensor, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        outside = (angle - cone).clamp(min=0.0)
        soft, safe = _nonzero(falloff)
        widths = (outside / safe).clamp(max=_WIDTHS)
        value = torch.exp(-0.5 * widths.square())
        return torch.where(soft, value, (outside <= 0.0).to(angle)), torch.where(soft, -widths / safe * value, 0.0)

    def half_and_width(self, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        return cone + HALF_WIDTHS * falloff, falloff

    def kinks(self, cone: float, falloff: float) -> list[float]:
        return [cone + step * falloff for step in _STEPS]

    def largest_falloff(self, cone: float) -> float:
        return math.radians(89.0)

    def emission(self, maths: Any, cosine: Any, cone: float, falloff: float) -> Any:
        outside = maths.maximum(maths.subtract(maths.arccosine(cosine), cone), 0.0)
        widths = maths.divide(outside, falloff)
        return maths.exponential(maths.multiply(maths.multiply(widths, widths), -0.5))


class Smoothstep(Profile):
    """Blender's: smoothstep of (cos θ − cos c)/(falloff·(1 − cos c)), its falloff the blend in [0, 1]."""

    name = "smoothstep"
    falloff_key = "blend"
    falloff_unit = ""

    def __call__(self, angle: Tensor, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        # cos θ − cos c = 2 sin((c + θ)/2) sin((c − θ)/2), which keeps its digits in a narrow cone.
        soft, safe = _nonzero(2.0 * falloff * torch.sin(0.5 * cone).square())
        y = (2.0 * torch.sin(0.5 * (cone + angle)) * torch.sin(0.5 * (cone - angle)) / safe).clamp(0.0, 1.0)
        value, slope = y * y * (3.0 - 2.0 * y), -6.0 * y * (1.0 - y) * torch.sin(angle) / safe
        return torch.where(soft, value, (angle <= cone).to(angle)), torch.where(soft, slope, 0.0)

    def half_and_width(self, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        width = falloff.clamp(0.0, 1.0) * (1.0 - torch.cos(cone))
        full, half = (torch.acos((torch.cos(cone) + part * width).clamp(-1.0, 1.0 - 1e-7)) for part in (1.0, 0.5))
        return half, (half - full).clamp(min=0.0) / HALF_WIDTHS

    def kinks(self, cone: float, falloff: float) -> list[float]:
        edge = math.cos(cone)
        return [math.acos(max(-1.0, min(1.0, edge + falloff * (1.0 - edge)))), cone]

    def largest_falloff(self, cone: float) -> float:
        return 1.0

    def emission(self, maths: Any, cosine: Any, cone: float, falloff: float) -> Any:
        edge = math.cos(cone)
        return maths.smoothstep(cosine, edge, edge + falloff * (1.0 - edge))


class Linear(Profile):
    """Mitsuba's: linear in θ between falloff (its beam angle) and the cone angle (its cutoff)."""

    name = "linear"
    falloff_key = "beam_angle"

    def __call__(self, angle: Tensor, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        soft, safe = _nonzero((cone - falloff).clamp(min=0.0))
        y = (cone - angle) / safe
        slope = torch.where((y > 0.0) & (y < 1.0), -1.0 / safe, 0.0)
        return torch.where(soft, y.clamp(0.0, 1.0), (angle <= cone).to(angle)), torch.where(soft, slope, 0.0)

    def half_and_width(self, cone: Tensor, falloff: Tensor) -> tuple[Tensor, Tensor]:
        full = torch.minimum(falloff, cone)
        half = 0.5 * (full + cone)
        return half, (half - full).clamp(min=0.0) / HALF_WIDTHS

    def kinks(self, cone: float, falloff: float) -> list[float]:
        return [falloff, cone]

    def largest_falloff(self, cone: float) -> float:
        return cone

    def emission(self, maths: Any, cosine: Any, cone: float, falloff: float) -> Any:
        return maths.linear(maths.arccosine(cosine), cone, falloff)

    def falloff_with(self, cone: float, falloff: float, changed: float) -> float:
        """The ratio of its two angles stays."""
        return falloff * changed / cone if cone > 0.0 else falloff


PROFILES = {profile.name: profile for profile in (Gaussian(), Smoothstep(), Linear())}


def softened(profile: Profile, cone: Tensor, falloff: Tensor, width: float) -> tuple[Profile, Tensor, Tensor]:
    """A profile with a rim that is wider by `width` [rad], with its cone angle and falloff; itself for 0.

    The wider one is a Gaussian that falls to one half at the same angle (unless it is wider than the cone itself).
    """
    if width == 0.0:
        return profile, cone, falloff
    half, sigma = profile.half_and_width(cone, falloff)
    wide = (sigma.square() + width**2).sqrt()
    return PROFILES["gaussian"], (half - HALF_WIDTHS * wide).clamp(min=0.0), wide


def _nonzero(width: Tensor) -> tuple[Tensor, Tensor]:
    """Where a rim has a width, and the width with 1 where it has none, to divide by."""
    soft = width > 0.0
    return soft, torch.where(soft, width, torch.ones_like(width))
