"""The corridor around a corner as rectangles: what training images show of it, and what no camera sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rgspipe.blender.models.parameters import CornerParameters, Vector
from rgspipe.scene.rectangles import Rectangles, rectangle, solid_box


@dataclass(frozen=True)
class Furniture:
    """A box on the floor, measured in widths of the corridor; see `rgspipe.blender.models.corner`.

    That module draws with bpy, which no other process may load, so its measures are repeated here; a test compares
    them.

    Attributes:
        leg: "near" or "far".
        along: from the wall at the end of the leg to the middle of the box.
        across: from the outer long wall.
        size: length, depth and height.
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


def corner_rectangles(corridor: CornerParameters) -> Rectangles:
    """Walls, floor and ceiling, which face into the corridor, and the furniture."""
    inner, top = corridor.width - 0.5, 0.5 * corridor.height
    outline = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-inner, 0.5), (-inner, inner), (-0.5, inner)]
    colours = {2: corridor.far_end, 5: corridor.near_end}
    parts = []
    for index, (x, y) in enumerate(outline):
        u, v = outline[(index + 1) % len(outline)]
        colour = list(colours.get(index, corridor.wall))
        parts.append(rectangle([u, v, -top], [x - u, y - v, 0.0], [0.0, 0.0, 2.0 * top], colour))
    # The floor and the ceiling of the near leg reach to the outer wall; those of the far one begin where these end.
    for low, long, deep in (((-0.5, -0.5), 1.0, corridor.width), ((-inner, inner), corridor.width, 0.5 - inner)):
        parts.append(rectangle([*low, -top], [long, 0.0, 0.0], [0.0, deep, 0.0], list(corridor.floor)))
        parts.append(rectangle([*low, top], [0.0, deep, 0.0], [long, 0.0, 0.0], list(corridor.wall)))
    parts += [_box(corridor, item) for item in FURNITURE.values()]
    joined = parts[0]
    for part in parts[1:]:
        joined = joined + part
    return joined


def _box(corridor: CornerParameters, item: Furniture) -> Rectangles:
    size = [length * corridor.width for length in item.size]
    along, across = item.along * corridor.width, item.across * corridor.width
    x, y = (along - 0.5, across - 0.5) if item.leg == "near" else (0.5 - across, 0.5 - along)
    return solid_box([x, y, 0.5 * (size[2] - corridor.height)], size, list(item.albedo), math.radians(item.degrees))
