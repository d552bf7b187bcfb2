"""What a light says of one number of its shape."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rgspipe.scene.lights.coordinates import Coordinate


@dataclass(frozen=True)
class ShapeNumber:
    """One number of a light's shape.

    Attributes:
        name: the light's field.
        key: its name in light files, and for people.
        unit: for people: "°" for angles, which fields hold in rad.
        coordinate: how a fit moves it; None where it does not.
        largest: what it can be at most, the others as they are.
        decimals: with which people are told it; None where it is left to files and tables.
    """

    name: str
    key: str
    unit: str = ""
    coordinate: Coordinate | None = None
    largest: float = math.inf
    decimals: int | None = 1

    def shown(self, value: float) -> float:
        """A value of the field in `unit`."""
        return math.degrees(value) if self.unit == "°" else value

    def natural(self, value: float) -> float:
        """A value in `unit` as the field holds it."""
        return math.radians(value) if self.unit == "°" else value
