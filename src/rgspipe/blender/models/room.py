"""A closed, furnished room: many objects, flat and curved, with procedural textures."""

from __future__ import annotations

import math

import bpy
import numpy as np

from rgspipe.blender.cameras import USUAL_CLASSES, RoomLayout
from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import (
    brick_material,
    checker_material,
    diffuse_material,
    mottled_material,
    striped_material,
)
from rgspipe.blender.meshes import add, ball, box, drum, new_scene, polygon, revolved
from rgspipe.blender.models.parameters import RoomParameters
from rgspipe.scene.models import Vector

#: Half the width (x) and depth (y), and half the height of the room.
SIDE, TOP = 0.5, 0.35

COLOURS: dict[str, Vector] = {
    "plaster": (0.76, 0.75, 0.72),
    "floor": (0.45, 0.28, 0.15),
    "wallpaper": (0.5, 0.58, 0.62),
    "clay": (0.6, 0.3, 0.18),
    "wood": (0.5, 0.33, 0.18),
    "fabric": (0.18, 0.3, 0.45),
    "rug": (0.6, 0.35, 0.3),
    "ball": (0.7, 0.12, 0.1),
    "leaves": (0.12, 0.35, 0.1),
    "china": (0.75, 0.75, 0.8),
    "lampshade": (0.8, 0.7, 0.45),
    "iron": (0.2, 0.2, 0.22),
    "picture": (0.6, 0.55, 0.25),
}

#: Width, height and colour of the books on a shelf, from the front to the back of the room.
BOOKS = (
    (0.035, 0.12, (0.6, 0.15, 0.1)),
    (0.028, 0.135, (0.15, 0.3, 0.5)),
    (0.04, 0.11, (0.7, 0.6, 0.3)),
    (0.03, 0.13, (0.2, 0.4, 0.25)),
    (0.045, 0.125, (0.45, 0.3, 0.5)),
)

TARGET_VIEWS = (
    FixedView((0.12, -0.43, 0.12), (-0.02, 0.3, -0.12), 72.0),
    FixedView((-0.28, -0.42, 0.2), (0.1, 0.3, -0.15), 72.0),
    FixedView((0.4, -0.36, 0.22), (-0.15, 0.25, -0.15), 72.0),
)

Materials = dict[str, bpy.types.Material]


def build(parameters: RoomParameters) -> bpy.types.Scene:
    """A new scene with the room and all that stands in it."""
    scene = new_scene()
    materials = {name: diffuse_material(name, colour) for name, colour in COLOURS.items()}
    if parameters.textured:
        materials |= _textures()
    _add_walls(scene, materials)
    _add_table(scene, materials)
    _add_bookcase(scene, materials)
    _add_armchair(scene, materials)
    _add_boxes(scene, materials)
    _add_round_things(scene, materials, parameters.segments)
    bpy.context.view_layer.update()
    return scene


def layout(_: RoomParameters, space: FreeSpace, resolution: int) -> RoomLayout:
    """Views across the room, which show more of it than a wall; the target cameras stand at its front."""
    return RoomLayout(space, resolution, USUAL_CLASSES, TARGET_VIEWS, sight=0.55)


def _textures() -> Materials:
    return {
        "floor": brick_material("boards", (0.52, 0.33, 0.18), (0.36, 0.21, 0.11), (0.12, 0.08, 0.05), (0.36, 0.072)),
        "wallpaper": striped_material("stripes", (0.42, 0.52, 0.58), (0.66, 0.68, 0.66), 0.1),
        "clay": mottled_material("terracotta", (0.48, 0.22, 0.13), (0.72, 0.42, 0.26), 0.06),
        "wood": striped_material("grain", (0.58, 0.4, 0.22), (0.42, 0.26, 0.13), 0.045, (0.0, 0.0, 1.2), 2.0),
        "fabric": mottled_material("cloth", (0.12, 0.22, 0.38), (0.28, 0.4, 0.52), 0.035),
        "rug": checker_material("weave", (0.66, 0.22, 0.18), (0.72, 0.64, 0.48), 0.07),
        "ball": striped_material("bands", (0.75, 0.12, 0.1), (0.8, 0.78, 0.7), 0.06, (0.0, 0.9, 0.3)),
        "leaves": mottled_material("foliage", (0.06, 0.24, 0.06), (0.25, 0.46, 0.14), 0.04),
        "picture": checker_material("painting", (0.75, 0.62, 0.2), (0.15, 0.3, 0.5), 0.05),
    }


def _add_walls(scene: bpy.types.Scene, materials: Materials) -> None:
    a, c = SIDE, TOP
    walls = {
        "floor": ([(-a, -a, -c), (a, -a, -c), (a, a, -c), (-a, a, -c)], "floor"),
        "ceiling": ([(-a, -a, c), (-a, a, c), (a, a, c), (a, -a, c)], "plaster"),
        "back": ([(-a, a, -c), (a, a, -c), (a, a, c), (-a, a, c)], "wallpaper"),
        "front": ([(-a, -a, -c), (-a, -a, c), (a, -a, c), (a, -a, -c)], "plaster"),
        "left": ([(-a, -a, -c), (-a, a, -c), (-a, a, c), (-a, -a, c)], "plaster"),
        "right": ([(a, -a, -c), (a, -a, c), (a, a, c), (a, a, -c)], "clay"),
    }
    for name, (corners, material) in walls.items():
        add(scene, polygon(name, corners), materials[material])


def _stand(
    scene: bpy.types.Scene, name: str, material: bpy.types.Material, size: Vector, foot: Vector, degrees: float = 0.0
) -> None:
    """Add a box whose lower face's centre is at `foot`, heights counted from the floor."""
    place = (foot[0], foot[1], foot[2] - TOP + 0.5 * size[2])
    add(scene, box(name, size), material, place=place, turn=math.radians(degrees))


def _add_table(scene: bpy.types.Scene, materials: Materials) -> None:
    x, y, height = -0.06, 0.08, 0.22
    _stand(scene, "table top", materials["wood"], (0.4, 0.26, 0.03), (x, y, height))
    for i, (u, v) in enumerate([(-1, -1), (1, -1), (1, 1), (-1, 1)]):
        _stand(scene, f"table leg {i}", materials["wood"], (0.035, 0.035, height), (x + 0.17 * u, y + 0.1 * v, 0.0))


def _add_bookcase(scene: bpy.types.Scene, materials: Materials) -> None:
    """At the left wall: sides, four boards, and books on two of them."""
    x, y, depth, width = -0.43, 0.2, 0.14, 0.34
    for name, side in (("front", -1.0), ("rear", 1.0)):
        _stand(scene, f"case {name}", materials["wood"], (depth, 0.03, 0.53), (x, y + 0.5 * side * (width - 0.03), 0.0))
    for level in range(4):
        foot = (x, y, 0.005 + 0.165 * level)
        _stand(scene, f"board {level}", materials["wood"], (depth, width - 0.06, 0.03), foot)
    for level in (1, 2):
        start = y - 0.5 * width + 0.04
        for index, (thickness, height, colour) in enumerate(BOOKS[:: 3 - 2 * level]):
            name = f"book {level} {index}"
            foot = (x - 0.01, start + 0.5 * thickness, 0.035 + 0.165 * level)
            _stand(scene, name, diffuse_material(name, colour), (0.1, thickness, height), foot)
            start += thickness + 0.003


def _add_armchair(scene: bpy.types.Scene, materials: Materials) -> None:
    """In the right corner of the back, turned towards the table."""
    center, degrees = np.array([0.29, 0.27]), -35.0
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    parts = {
        "seat": ((0.2, 0.2, 0.12), (0.0, -0.02, 0.0)),
        "back rest": ((0.3, 0.06, 0.3), (0.0, 0.11, 0.0)),
        "left arm": ((0.05, 0.2, 0.19), (-0.125, -0.02, 0.0)),
        "right arm": ((0.05, 0.2, 0.19), (0.125, -0.02, 0.0)),
    }
    for name, (size, (u, v, w)) in parts.items():
        x, y = center + np.array([c * u - s * v, s * u + c * v])
        _stand(scene, name, materials["fabric"], size, (x, y, w), degrees)


def _add_boxes(scene: bpy.types.Scene, materials: Materials) -> None:
    _stand(scene, "rug", materials["rug"], (0.56, 0.42, 0.02), (-0.04, 0.03, 0.0))
    _stand(scene, "large crate", materials["wood"], (0.16, 0.16, 0.16), (0.36, -0.14, 0.0), 12.0)
    _stand(scene, "small crate", materials["clay"], (0.1, 0.1, 0.1), (0.35, -0.13, 0.16), 40.0)
    _stand(scene, "picture", materials["picture"], (0.3, 0.03, 0.2), (-0.05, 0.485, 0.4))


def _add_round_things(scene: bpy.types.Scene, materials: Materials, segments: int) -> None:
    """Heights of the outlines are counted from the floor."""
    table = 0.25
    things = {
        "ball": (ball(0.055), (-0.17, 0.05, table + 0.055), "ball"),
        "vase": (_vase(), (0.05, 0.12, table), "china"),
        "stool": (drum(0.075, 0.17), (-0.33, -0.2, 0.0), "fabric"),
        "pot": (drum(0.06, 0.1), (0.12, 0.4, 0.0), "clay"),
        "leaves": (ball(0.09), (0.12, 0.4, 0.17), "leaves"),
        "lamp foot": (drum(0.06, 0.02), (-0.38, -0.41, 0.0), "iron"),
        "lamp pole": (drum(0.014, 0.42), (-0.38, -0.41, 0.01), "iron"),
        "lampshade": (_shade(), (-0.38, -0.41, 0.4), "lampshade"),
    }
    for name, (outline, (x, y, z), material) in things.items():
        add(scene, revolved(name, outline, segments), materials[material], place=(x, y, z - TOP))


def _shade() -> np.ndarray:
    """Outline of a lampshade, solid: a cone without its tip."""
    return np.array([[0.0, 0.0], [0.09, 0.0], [0.045, 0.13], [0.0, 0.13]])


def _vase() -> np.ndarray:
    """Outline of a closed vase that stands on the origin."""
    height = np.linspace(0.0, 1.0, 96)
    radius = 0.022 + 0.03 * np.sin(math.pi * np.minimum(1.0, 0.12 + height)) ** 2 + 0.012 * height**6
    side = np.stack([radius, 0.15 * height], axis=-1)
    return np.concatenate([[[0.0, 0.0]], side, [[0.0, 0.15]]])
