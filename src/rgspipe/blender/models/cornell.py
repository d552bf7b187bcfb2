"""The parametric Cornell box in bpy."""

from __future__ import annotations

import bpy

from rgspipe.blender.cameras import CornellLayout
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import diffuse_material, glossy_material
from rgspipe.blender.meshes import add, add_rectangles, box, new_scene
from rgspipe.scene.models import Box, CornellBox
from rgspipe.scene.models.cornell import WALLS


def build(model: CornellBox) -> bpy.types.Scene:
    """A new scene that holds the room and its boxes, and nothing else: no light, camera or world."""
    scene = new_scene()
    add_rectangles(scene, model.walls(), WALLS)
    for index, item in enumerate(model.boxes):
        name = f"box_{index}"
        add(scene, box(name, item.size), _box_material(name, item, model), place=item.center, turn=item.turn)
    bpy.context.view_layer.update()
    return scene


def layout(_: CornellBox, space: FreeSpace, resolution: int) -> CornellLayout:
    """Views from in front of the room and from within."""
    return CornellLayout(space, resolution)


def _box_material(name: str, item: Box, model: CornellBox) -> bpy.types.Material:
    if model.gloss == 0.0:
        return diffuse_material(name, item.albedo)
    return glossy_material(name, item.albedo, model.gloss, model.shininess)
