"""Point lights, which shine alike in all directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from torch import Tensor

from rgspipe.scene.lights.light import WATTS_PER_INTENSITY, Light
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.shapes import Float


@dataclass(frozen=True)
class PointLight(Light):
    """An isotropic point light: radiant intensity `intensity` [W/sr] in every direction."""

    kind: ClassVar[str] = "point"

    @classmethod
    def shaped(cls) -> Self:
        """A point light of 1 W/sr at the origin."""
        return cls([0.0, 0.0, 0.0], 1.0)

    def power(self) -> Float[Tensor, " 3"]:
        return WATTS_PER_INTENSITY * self.intensity

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        return cls(position, intensity)
