"""A hot dog on a plate, in empty space: smooth curved surfaces with procedural textures."""

from __future__ import annotations

import math

import bpy
import numpy as np

from rgspipe.blender.cameras import ObjectLayout
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import diffuse_material, mottled_material, striped_material
from rgspipe.blender.meshes import add, new_scene, revolved, swept
from rgspipe.blender.models.parameters import HotdogParameters
from rgspipe.scene.models import Vector

#: Half lengths of bun and sausage along x, and how far above the middle of the scene they are.
BUN_LENGTH, BUN_WIDTH, BUN_HEIGHT, BUN_LEVEL = 0.34, 0.155, 0.1, -0.005
SAUSAGE_LENGTH, SAUSAGE_RADIUS, SAUSAGE_LEVEL = 0.39, 0.062, 0.055

#: Waves of the sauce, how far they swing, and the radius of its line.
SAUCE_WAVES, SAUCE_SWING, SAUCE_RADIUS = 4.5, 0.032, 0.0135

COLOURS: dict[str, Vector] = {
    "plate": (0.78, 0.78, 0.76),
    "rim": (0.15, 0.25, 0.55),
    "crust": (0.62, 0.33, 0.11),
    "crumb": (0.82, 0.68, 0.44),
    "sausage": (0.5, 0.13, 0.06),
    "sauce": (0.8, 0.55, 0.03),
}


def build(parameters: HotdogParameters) -> bpy.types.Scene:
    """A new scene with plate, bun, sausage and sauce."""
    scene = new_scene()
    materials = _materials(parameters.textured)
    segments = parameters.segments
    profile, paint = _plate_outline()
    add(scene, revolved("plate", profile, segments, paint), materials["plate"], materials["rim"])
    rings, paint = _bun(segments)
    add(scene, swept("bun", rings, paint), materials["crust"], materials["crumb"])
    add(scene, swept("sausage", _sausage(segments)), materials["sausage"])
    add(scene, swept("sauce", _sauce(segments)), materials["sauce"])
    bpy.context.view_layer.update()
    return scene


def layout(_: HotdogParameters, space: FreeSpace, resolution: int) -> ObjectLayout:
    """Cameras and lights in shells above and around the plate; what is to be hidden stands behind the bun."""
    return ObjectLayout(
        space, resolution, distances=(1.9, 2.3), lowest_view=0.2, nearest_light=0.9, lowest_light=0.05,
        hidden_reach=0.8, target_slope=0.5,
    )  # fmt: skip


def _materials(textured: bool) -> dict[str, bpy.types.Material]:
    materials = {name: diffuse_material(name, colour) for name, colour in COLOURS.items()}
    if textured:
        materials["crust"] = mottled_material("baked", (0.5, 0.24, 0.07), (0.72, 0.44, 0.18), 0.12)
        materials["crumb"] = mottled_material("crumbs", (0.7, 0.52, 0.28), (0.86, 0.74, 0.52), 0.02)
        grilled = (0.55, 0.16, 0.07), (0.3, 0.07, 0.04)
        materials["sausage"] = striped_material("grilled", *grilled, 0.11, (0.0, 0.0, 0.6), 0.6)
    return materials


def _plate_outline() -> tuple[np.ndarray, np.ndarray]:
    """Radius and height along the plate, from the middle of its top to the middle of its foot; the rim's paint."""
    radius = np.concatenate([np.linspace(0.0, 0.3, 12), np.linspace(0.3, 0.49, 40)[1:]])
    rise = np.clip((radius - 0.3) / 0.19, 0.0, 1.0)
    top = np.stack([radius, -0.105 + 0.07 * rise * rise * (1.5 - 0.5 * rise)], axis=-1)
    slope = math.atan2(*(top[-1] - top[-2])[::-1])
    turn = np.linspace(slope, math.pi, 64)[1:]
    lip = top[-1] + 0.01 * np.stack([np.sin(turn) - math.sin(slope), np.cos(turn) - math.cos(slope)], axis=-1)
    foot = np.array([[0.3, -0.125], [0.0, -0.125]])
    outline = np.concatenate([top, lip, foot])
    middle = 0.5 * (outline[:-1, 0] + outline[1:, 0])
    is_top = np.arange(len(middle)) < len(top) - 1
    return outline, (is_top & (middle > 0.42) & (middle < 0.455)).astype(int)


def _bun(segments: int) -> tuple[np.ndarray, np.ndarray]:
    """A loaf with a groove along its top; crust outside and crumb in the groove."""
    opening = math.radians(50.0)
    crust = np.linspace(opening, 2.0 * math.pi - opening, segments)  # from the top, around below, to the top
    y, z = BUN_WIDTH * np.sin(crust), BUN_HEIGHT * np.cos(crust)
    half, depth = y[0], 0.75 * BUN_HEIGHT
    across = np.linspace(0.0, math.pi, segments // 2)[1:-1]
    groove_y, groove_z = -half * np.cos(across), z[0] - depth * np.sin(across)
    section = np.stack([np.concatenate([y, groove_y]), np.concatenate([z, groove_z])], axis=-1)
    paint = (np.arange(len(section)) >= len(crust) - 1).astype(int)
    return _tapered(section, BUN_LENGTH, segments, 4.0) + np.array([0.0, 0.0, BUN_LEVEL]), paint


def _tapered(section: np.ndarray, length: float, count: int, power: float) -> np.ndarray:
    """Rings of a section (S, 2) in y and z along x that shrink to a point at both ends as a superellipse does."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, count)
    sine = np.sin(angle)
    scale = (1.0 - np.abs(sine) ** power) ** 0.5
    along = np.broadcast_to(length * sine[:, None, None], (count, len(section), 1))
    return np.concatenate([along, scale[:, None, None] * section], axis=-1)


def _sausage(segments: int) -> np.ndarray:
    """A bent capsule."""
    around = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    section = SAUSAGE_RADIUS * np.stack([np.cos(around), np.sin(around)], axis=-1)
    rings = _tapered(section, SAUSAGE_LENGTH, segments, 8.0)
    rings[..., 2] += _bend(rings[..., 0])
    return rings


def _bend(x: np.ndarray) -> np.ndarray:
    """Height of the sausage's middle: its ends rise."""
    return SAUSAGE_LEVEL + 0.16 * x * x


def _sauce(segments: int) -> np.ndarray:
    """A tube that winds along the top of the sausage."""
    step = np.linspace(-1.0, 1.0, 3 * segments)
    x = 0.32 * step
    y = SAUCE_SWING * np.sin(SAUCE_WAVES * math.pi * step)
    z = _bend(x) + np.sqrt(SAUSAGE_RADIUS**2 - y * y) + 0.4 * SAUCE_RADIUS
    path = np.stack([x, y, z], axis=-1)
    radius = SAUCE_RADIUS * (1.0 - np.abs(step) ** 60) ** 0.5
    return _tube(path, radius, segments // 2)


def _tube(path: np.ndarray, radius: np.ndarray, around: int) -> np.ndarray:
    """Rings (P, around, 3) about a path (P, 3) that never runs straight up."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, tangent)
    angle = np.linspace(0.0, 2.0 * math.pi, around, endpoint=False)[:, None]
    circle = np.cos(angle) * side[:, None] + np.sin(angle) * up[:, None]
    return path[:, None] + radius[:, None, None] * circle
