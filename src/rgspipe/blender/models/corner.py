"""The corridor that turns a corner in bpy."""

from __future__ import annotations

import bpy

from rgspipe.blender.cameras import USUAL_CLASSES, RoomLayout
from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, add_rectangles, box, new_scene, polygon
from rgspipe.scene.models import Corridor

#: Along, across and height of the target cameras and of the points that they look at, in widths of the corridor.
TARGET_VIEWS = (
    ((1.55, 0.7, 0.15), (0.0, 0.42, -0.1)),
    ((1.42, 0.4, 0.35), (0.1, 0.6, -0.2)),
    ((1.5, 0.55, -0.1), (0.0, 0.5, 0.05)),
)
TARGET_DEGREES = 75.0


def build(model: Corridor) -> bpy.types.Scene:
    """A new scene with the corridor, a pillar and a crate in one leg, and a cabinet in the other."""
    scene, plan = new_scene(), model.plan()
    add(scene, polygon("floor", plan.floor_corners()), diffuse_material("floor", plan.floor))
    add(scene, polygon("ceiling", plan.ceiling_corners()), diffuse_material("ceiling", plan.ceiling))
    add_rectangles(scene, plan.wall_rectangles(), [f"wall_{index}" for index in range(len(plan.walls))])
    for name, item in model.furniture().items():
        add(scene, box(name, item.size), diffuse_material(name, item.albedo), place=item.center, turn=item.turn)
    bpy.context.view_layer.update()
    return scene


def layout(model: Corridor, space: FreeSpace, resolution: int) -> RoomLayout:
    """Views anywhere in the corridor; the target cameras stand in the near leg and look away from the corner."""
    fixed = []
    for (along, across, height), (focus_along, focus_across, focus_height) in TARGET_VIEWS:
        origin = (*model.place("near", along, across), height * model.width)
        focus = (*model.place("near", focus_along, focus_across), focus_height * model.width)
        fixed.append(FixedView(origin, focus, TARGET_DEGREES))
    return RoomLayout(space, resolution, (*USUAL_CLASSES, "around_corner"), tuple(fixed))
