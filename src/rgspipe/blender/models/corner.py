"""A closed corridor that turns a corner: light from one leg reaches the end of the other by bounces alone."""

from __future__ import annotations

import math

import bpy

from rgspipe.blender.cameras import USUAL_CLASSES, RoomLayout
from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, box, new_scene, polygon
from rgspipe.blender.models.corridor import FURNITURE, outline, place, wall_colours
from rgspipe.blender.models.parameters import CornerParameters, Vector

#: Along, across and height of the target cameras and of the points that they look at, in widths of the corridor.
TARGET_VIEWS = (
    ((1.55, 0.7, 0.15), (0.0, 0.42, -0.1)),
    ((1.42, 0.4, 0.35), (0.1, 0.6, -0.2)),
    ((1.5, 0.55, -0.1), (0.0, 0.5, 0.05)),
)
TARGET_DEGREES = 75.0


def build(parameters: CornerParameters) -> bpy.types.Scene:
    """A new scene with the corridor, a pillar and a crate in one leg, and a cabinet in the other."""
    scene = new_scene()
    for name, corners, albedo in _walls(parameters):
        add(scene, polygon(name, corners), diffuse_material(name, albedo))
    for name, item in FURNITURE.items():
        middle, size = item.measures(parameters)
        add(scene, box(name, size), diffuse_material(name, item.albedo), place=middle, turn=math.radians(item.degrees))
    bpy.context.view_layer.update()
    return scene


def layout(parameters: CornerParameters, space: FreeSpace, resolution: int) -> RoomLayout:
    """Views anywhere in the corridor; the target cameras stand in the near leg and look away from the corner."""
    fixed = []
    for (along, across, height), (focus_along, focus_across, focus_height) in TARGET_VIEWS:
        origin = (*place(parameters, "near", along, across), height * parameters.width)
        focus = (*place(parameters, "near", focus_along, focus_across), focus_height * parameters.width)
        fixed.append(FixedView(origin, focus, TARGET_DEGREES))
    return RoomLayout(space, resolution, (*USUAL_CLASSES, "around_corner"), tuple(fixed))


def _walls(parameters: CornerParameters) -> list[tuple[str, list[Vector], Vector]]:
    """Name, corners and albedo of the walls; all face into the corridor."""
    top, floor = 0.5 * parameters.height, outline(parameters)
    walls = [
        ("floor", [(x, y, -top) for x, y in floor], parameters.floor),
        ("ceiling", [(x, y, top) for x, y in reversed(floor)], parameters.wall),
    ]
    for index, ((x, y), colour) in enumerate(zip(floor, wall_colours(parameters), strict=True)):
        u, v = floor[(index + 1) % len(floor)]
        walls.append((f"wall_{index}", [(u, v, -top), (x, y, -top), (x, y, top), (u, v, top)], colour))
    return walls
