"""Surfaces that shine evenly: what a light with an extent is to programs that have such lights."""

from __future__ import annotations

import math
from dataclasses import dataclass

from torch import Tensor

from rgspipe.scene.shapes import Float


@dataclass(frozen=True)
class EvenSphere:
    """A sphere around the light's place that shines to all sides.

    Attributes:
        radius: scene units.
    """

    radius: float | Tensor

    @property
    def area(self) -> float:
        """Square scene units of it that are seen from anywhere: its radiance is the intensity over them."""
        return math.pi * float(self.radius) ** 2


@dataclass(frozen=True)
class EvenRectangle:
    """A rectangle around the light's place that shines to the side of its axis.

    Attributes:
        width, height: scene units.
        across, up: (3,) unit vectors along them; with the axis they are right-handed.
    """

    width: float | Tensor
    height: float | Tensor
    across: Float[Tensor, " 3"]
    up: Float[Tensor, " 3"]

    @property
    def area(self) -> float:
        """Square scene units: its radiance is the intensity along the axis over them."""
        return float(self.width) * float(self.height)


Surface = EvenSphere | EvenRectangle
