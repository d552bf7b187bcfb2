"""LEDs: lights whose intensity falls with a power of the cosine of the angle from their axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import torch
from torch import Tensor

from rgspipe.scene.lights.axial import AxialLight
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.lights.shape_coordinates import Ratio
from rgspipe.scene.lights.shape_number import ShapeNumber

#: A free exponent stays between these: from nearly the whole half-space to a beam of 2° (standard deviation).
EXPONENT = Ratio(0.5, 1000.0)

#: Exponents that a search tries where the exponent is free: half-angles of 60°, 33° and 17°.
EXPONENTS = (1.0, 4.0, 16.0)

#: Below this cosine the slope of an exponent under 1, which is infinite at the horizon, rises no more.
_HORIZON = 1e-3


@dataclass(frozen=True)
class LedLight(AxialLight):
    """A light with radiant intensity I cosᵐθ in front of it, and none behind (Lambertian for m = 1).

    Attributes:
        exponent: m ≥ 0; ln ½ / ln cos of the half-angle that data sheets give.
    """

    kind: ClassVar[str] = "led"
    ranges: ClassVar = {"exponent": ("an exponent, 0 or more", 0.0, math.inf)}

    exponent: float

    @classmethod
    def shaped(cls, exponent: float = 1.0) -> Self:
        return cls([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0], exponent)

    @property
    def shape(self) -> tuple[ShapeNumber, ...]:
        return (ShapeNumber("exponent", "exponent", "", EXPONENT),)

    @property
    def rim(self) -> float:
        """cosᵐθ ≈ exp(−mθ²/2)."""
        return self.exponent**-0.5 if self.exponent > 0.0 else 0.0

    @property
    def faces_away(self) -> bool:
        return True

    def profile_at(self, angle: Tensor, numbers: Mapping[str, Tensor], softness: float = 0.0) -> tuple[Tensor, Tensor]:
        """As cosᵐθ is nearly a Gaussian of variance 1/m, a softer one has 1/m + softness² in its place."""
        exponent = numbers["exponent"]
        exponent = exponent / (1.0 + exponent * softness**2)
        cosine = torch.cos(angle)
        front = cosine > 0.0
        safe = torch.where(front, cosine, torch.ones_like(cosine))
        value = torch.where(front, safe**exponent, 0.0)
        slope = -exponent * safe.clamp(min=_HORIZON) ** (exponent - 1.0) * torch.sin(angle)
        return value, torch.where(front, slope, 0.0)

    def kinks(self, softness: float = 0.0) -> list[float]:
        """The horizon, and steps down a narrow beam, so that quadrature converges."""
        width = (1.0 / max(self.exponent, 1e-6) + softness**2) ** 0.5
        return [min(step * width, 0.5 * math.pi) for step in (3.0, 6.0, 9.0)] + [0.5 * math.pi]

    def variants(self) -> tuple[Self, ...]:
        return tuple(replace(self, exponent=exponent) for exponent in EXPONENTS)

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        return cls(position, intensity, reader.direction("direction"), reader.number("exponent"))

    def emission(self, maths: Any, cosine: Any) -> Any:
        # 0 to the power of 0 is 1, and behind an LED it is dark whatever its exponent.
        front = maths.power(maths.maximum(cosine, 0.0), self.exponent)
        return maths.multiply(front, maths.greater_than(cosine, 0.0))
