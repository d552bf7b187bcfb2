"""A closed corridor that turns a corner: light from one leg reaches the end of the other by bounces alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from rgspipe.blender.cameras import USUAL_CLASSES, FixedView, RoomLayout
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, box, new_scene, polygon
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


FURNITURE = {
    "pillar": Furniture("near", 0.62, 0.6, (0.28, 0.28, 0.85), 20.0, (0.7, 0.68, 0.6)),
    "crate": Furniture("near", 0.35, 0.22, (0.3, 0.3, 0.35), -15.0, (0.65, 0.3, 0.2)),
    "cabinet": Furniture("far", 0.4, 0.24, (0.3, 0.5, 0.6), 8.0, (0.25, 0.5, 0.3)),
}

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
        size = tuple(length * parameters.width for length in item.size)
        x, y = _place(parameters, item.leg, item.along, item.across)
        place = (x, y, 0.5 * (size[2] - parameters.height))
        add(scene, box(name, size), diffuse_material(name, item.albedo), place=place, turn=math.radians(item.degrees))
    bpy.context.view_layer.update()
    return scene


def layout(parameters: CornerParameters, space: FreeSpace, resolution: int) -> RoomLayout:
    """Views anywhere in the corridor; the target cameras stand in the near leg and look away from the corner."""
    fixed = []
    for (along, across, height), (focus_along, focus_across, focus_height) in TARGET_VIEWS:
        origin = (*_place(parameters, "near", along, across), height * parameters.width)
        focus = (*_place(parameters, "near", focus_along, focus_across), focus_height * parameters.width)
        fixed.append(FixedView(origin, focus, TARGET_DEGREES))
    return RoomLayout(space, resolution, (*USUAL_CLASSES, "around_corner"), tuple(fixed))


def _place(parameters: CornerParameters, leg: str, along: float, across: float) -> tuple[float, float]:
    """x and y of a place in a leg, given in widths of the corridor."""
    along, across = along * parameters.width, across * parameters.width
    return (along - 0.5, across - 0.5) if leg == "near" else (0.5 - across, 0.5 - along)


def _walls(parameters: CornerParameters) -> list[tuple[str, list[Vector], Vector]]:
    """Name, corners and albedo of the walls; all face into the corridor."""
    inner, top = parameters.width - 0.5, 0.5 * parameters.height
    outline = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-inner, 0.5), (-inner, inner), (-0.5, inner)]
    walls = [
        ("floor", [(x, y, -top) for x, y in outline], parameters.floor),
        ("ceiling", [(x, y, top) for x, y in reversed(outline)], parameters.wall),
    ]
    colours = {2: parameters.far_end, 5: parameters.near_end}
    for index, (x, y) in enumerate(outline):
        u, v = outline[(index + 1) % len(outline)]
        # Counter-clockwise around the corridor: the inside is to the left of each wall.
        corners = [(u, v, -top), (x, y, -top), (x, y, top), (u, v, top)]
        walls.append((f"wall_{index}", corners, colours.get(index, parameters.wall)))
    return walls
