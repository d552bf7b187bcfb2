"""A closed corridor that turns a corner: light from one leg reaches the end of the other by bounces alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rgspipe.arguments import as_number
from rgspipe.scene.models.box import Box, Vector, check_albedo
from rgspipe.scene.models.floor_plan import FloorPlan
from rgspipe.scene.rectangles import Rectangles


@dataclass(frozen=True)
class Furniture:
    """A box on the floor, measured in widths of the corridor.

    Attributes:
        leg: "near", the one with the target cameras, or "far".
        along: from the wall at the end of the leg to the middle of the box.
        across: from the outer long wall.
        size: length, depth and height of the box.
        degrees: its turn about the vertical.
        albedo: diffuse reflectance RGB.
    """

    leg: str
    along: float
    across: float
    size: Vector
    degrees: float
    albedo: Vector


FURNITURE = {
    "pillar": Furniture("near", 0.62, 0.6, (0.28, 0.28, 0.85), 20.0, (0.7, 0.68, 0.6)),
    "crate": Furniture("near", 0.35, 0.22, (0.3, 0.3, 0.35), -15.0, (0.65, 0.3, 0.2)),
    "cabinet": Furniture("far", 0.4, 0.24, (0.3, 0.5, 0.6), 8.0, (0.25, 0.5, 0.3)),
}


@dataclass(frozen=True)
class Corridor:
    """Two legs, one along −x and one along +y, each 1 long outside, with furniture in both.

    Attributes:
        width: of the corridor.
        height: of the corridor.
        wall: albedo of walls and ceiling.
        floor: albedo of the floor.
        near_end, far_end: albedo of the walls at the end of the leg with the target cameras, and of the other.

    Raises:
        InputError: a length is out of range, or a reflectance not from 0 to 1.
    """

    width: float = 0.32
    height: float = 0.45
    wall: Vector = (0.75, 0.75, 0.72)
    floor: Vector = (0.55, 0.5, 0.42)
    near_end: Vector = (0.2, 0.35, 0.65)
    far_end: Vector = (0.7, 0.4, 0.15)

    def __post_init__(self) -> None:
        expected = "a width below the 1 that each leg is long"
        as_number(self.width, "width", expected=expected, low=math.nextafter(0.0, 1.0), high=math.nextafter(1.0, 0.0))
        as_number(self.height, "height", expected="a height above 0", low=math.nextafter(0.0, 1.0))
        for name in ("wall", "floor", "near_end", "far_end"):
            check_albedo(name, getattr(self, name))

    def plan(self) -> FloorPlan:
        """Its walls, floor and ceiling."""
        inner = self.width - 0.5
        outline = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-inner, 0.5), (-inner, inner), (-0.5, inner))
        walls = (self.wall, self.wall, self.far_end, self.wall, self.wall, self.near_end)
        return FloorPlan(outline, self.height, walls, self.floor, self.wall)

    def furniture(self) -> dict[str, Box]:
        """What stands in it, by name."""
        return {name: self._box(item) for name, item in FURNITURE.items()}

    def rectangles(self) -> Rectangles:
        """Walls, floor and ceiling, which face into the corridor, then the faces of the furniture."""
        return sum((box.rectangles() for box in self.furniture().values()), self.plan().rectangles())

    def place(self, leg: str, along: float, across: float) -> tuple[float, float]:
        """x and y of a place in a leg, given in widths of the corridor as in `Furniture`."""
        along, across = along * self.width, across * self.width
        return (along - 0.5, across - 0.5) if leg == "near" else (0.5 - across, 0.5 - along)

    def _box(self, item: Furniture) -> Box:
        size = tuple(length * self.width for length in item.size)
        x, y = self.place(item.leg, item.along, item.across)
        return Box((x, y, 0.5 * (size[2] - self.height)), size, math.radians(item.degrees), item.albedo)
