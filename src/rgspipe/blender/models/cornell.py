"""The parametric Cornell box, modelled in bpy."""

from __future__ import annotations

import bpy

from rgspipe.blender.cameras import CornellLayout
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import diffuse_material, glossy_material
from rgspipe.blender.meshes import add, box, new_scene, polygon
from rgspipe.blender.models.parameters import Box, CornellParameters, Vector


def build(parameters: CornellParameters) -> bpy.types.Scene:
    """A new scene that holds the room and its boxes, and nothing else: no light, camera or world."""
    scene = new_scene()
    for name, corners, albedo in _walls(parameters):
        add(scene, polygon(name, corners), diffuse_material(name, albedo))
    for index, item in enumerate(parameters.boxes):
        name = f"box_{index}"
        add(scene, box(name, item.size), _box_material(name, item, parameters), place=item.center, turn=item.turn)
    bpy.context.view_layer.update()
    return scene


def layout(_: CornellParameters, space: FreeSpace, resolution: int) -> CornellLayout:
    """Views from in front of the room and from within."""
    return CornellLayout(space, resolution)


def _box_material(name: str, item: Box, parameters: CornellParameters) -> bpy.types.Material:
    if parameters.gloss == 0.0:
        return diffuse_material(name, item.albedo)
    return glossy_material(name, item.albedo, parameters.gloss, parameters.shininess)


def _walls(parameters: CornellParameters) -> list[tuple[str, list[Vector], Vector]]:
    """Name, corners and albedo of the five walls; all face into the room."""
    a, b, c = (0.5 * length for length in parameters.room)
    floor = [(-a, -b, -c), (a, -b, -c), (a, b, -c), (-a, b, -c)]
    ceiling = [(-a, -b, c), (-a, b, c), (a, b, c), (a, -b, c)]
    back = [(-a, b, -c), (a, b, -c), (a, b, c), (-a, b, c)]
    left = [(-a, -b, -c), (-a, b, -c), (-a, b, c), (-a, -b, c)]
    right = [(a, -b, -c), (a, -b, c), (a, b, c), (a, b, -c)]
    white = [("floor", floor), ("ceiling", ceiling), ("back", back)]
    walls = [(name, corners, parameters.white) for name, corners in white]
    return [*walls, ("left", left, parameters.left), ("right", right, parameters.right)]
