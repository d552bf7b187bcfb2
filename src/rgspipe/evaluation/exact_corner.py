"""The corridor around a corner as rectangles: what training images show of it, and what no camera sees."""

from __future__ import annotations

import math

from rgspipe.blender.models.corridor import FURNITURE, Furniture, outline, wall_colours
from rgspipe.blender.models.parameters import CornerParameters
from rgspipe.scene.rectangles import Rectangles, rectangle, solid_box


def corner_rectangles(corridor: CornerParameters) -> Rectangles:
    """Walls, floor and ceiling, which face into the corridor, and the furniture."""
    inner, top = corridor.width - 0.5, 0.5 * corridor.height
    corners, parts = outline(corridor), []
    for index, ((x, y), colour) in enumerate(zip(corners, wall_colours(corridor), strict=True)):
        u, v = corners[(index + 1) % len(corners)]
        parts.append(rectangle([u, v, -top], [x - u, y - v, 0.0], [0.0, 0.0, 2.0 * top], list(colour)))
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
    middle, size = item.measures(corridor)
    return solid_box(list(middle), list(size), list(item.albedo), math.radians(item.degrees))
