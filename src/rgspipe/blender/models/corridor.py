"""What stands in the corridor that turns a corner, and where: for the Blender model and for its exact rectangles.

Imports without bpy.
"""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.blender.models.parameters import CornerParameters, Vector


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

    def measures(self, corridor: CornerParameters) -> tuple[Vector, Vector]:
        """Middle and size, scene units."""
        size = tuple(length * corridor.width for length in self.size)
        x, y = place(corridor, self.leg, self.along, self.across)
        return (x, y, 0.5 * (size[2] - corridor.height)), size


FURNITURE = {
    "pillar": Furniture("near", 0.62, 0.6, (0.28, 0.28, 0.85), 20.0, (0.7, 0.68, 0.6)),
    "crate": Furniture("near", 0.35, 0.22, (0.3, 0.3, 0.35), -15.0, (0.65, 0.3, 0.2)),
    "cabinet": Furniture("far", 0.4, 0.24, (0.3, 0.5, 0.6), 8.0, (0.25, 0.5, 0.3)),
}


def place(corridor: CornerParameters, leg: str, along: float, across: float) -> tuple[float, float]:
    """x and y of a place in a leg, given in widths of the corridor."""
    along, across = along * corridor.width, across * corridor.width
    return (along - 0.5, across - 0.5) if leg == "near" else (0.5 - across, 0.5 - along)


def outline(corridor: CornerParameters) -> list[tuple[float, float]]:
    """x and y of the floor's corners, counter-clockwise: the inside is to the left of each wall."""
    inner = corridor.width - 0.5
    return [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-inner, 0.5), (-inner, inner), (-0.5, inner)]


def wall_colours(corridor: CornerParameters) -> list[Vector]:
    """Albedo of the walls, in the order of the outline's corners at which they begin."""
    colours = {2: corridor.far_end, 5: corridor.near_end}
    return [colours.get(index, corridor.wall) for index in range(6)]
