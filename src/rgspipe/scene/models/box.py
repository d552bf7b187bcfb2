"""A box that stands in a room."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.scene.rectangles import Rectangles, solid_box

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """A solid box.

    Attributes:
        center: scene units.
        size: edge lengths, scene units.
        turn: rotation about +z, rad.
        albedo: diffuse reflectance RGB.
    """

    center: Vector
    size: Vector
    turn: float
    albedo: Vector = (0.73, 0.73, 0.73)

    def rectangles(self) -> Rectangles:
        """Its six faces, which face outwards; that on which it stands is there too."""
        return solid_box(self.center, self.size, self.albedo, self.turn)
