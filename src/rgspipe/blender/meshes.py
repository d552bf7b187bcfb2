"""Meshes for models: boxes, and smooth solids swept from curves, fine enough that their normals are those of a face."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bmesh
import bpy
import numpy as np

from rgspipe.blender.materials import diffuse_material
from rgspipe.scene.models import Vector
from rgspipe.scene.rectangles import Rectangles

#: Faces that meet at more than this [rad] form an edge; all others are parts of one smooth surface.
EDGE_ANGLE = math.radians(15.0)

#: Points nearer than this are one: the poles of swept solids, scene units.
MERGE_DISTANCE = 1e-6


def new_scene() -> bpy.types.Scene:
    """An empty scene, the only one: no object, light, camera or world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def add(
    scene: bpy.types.Scene, mesh: bpy.types.Mesh, *materials: bpy.types.Material, place: Vector = (0.0, 0.0, 0.0),
    turn: float = 0.0,
) -> bpy.types.Object:  # fmt: skip
    """Put a mesh into the scene, at `place`, turned about the vertical by `turn` [rad]."""
    for material in materials:
        mesh.materials.append(material)
    item = bpy.data.objects.new(mesh.name, mesh)
    item.location, item.rotation_euler = place, (0.0, 0.0, turn)
    scene.collection.objects.link(item)
    return item


def add_rectangles(scene: bpy.types.Scene, rectangles: Rectangles, names: Sequence[str]) -> None:
    """Put flat, diffuse rectangles into the scene, each an object of its own."""
    for name, corners, albedo in zip(names, rectangles.corners.tolist(), rectangles.albedo.tolist(), strict=True):
        add(scene, polygon(name, corners), diffuse_material(name, tuple(albedo)))


def polygon(name: str, corners: Sequence[Sequence[float]]) -> bpy.types.Mesh:
    """One flat face; its front is the side from which the corners run counter-clockwise."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [tuple(range(len(corners)))])
    return mesh


def box(name: str, size: Vector) -> bpy.types.Mesh:
    """A box around the origin, with flat faces."""
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(c * s for c, s in zip(corner, size, strict=True)) for corner in corners], [], faces)
    return mesh


def swept(name: str, rings: np.ndarray, materials: np.ndarray | int = 0) -> bpy.types.Mesh:
    """A solid through R rings of S points each, (R, S, 3); smooth but for edges above EDGE_ANGLE.

    Every ring is closed; a first or last ring that has not shrunk to a point is closed by a flat face.

    Args:
        materials: broadcast to (R − 1, S), index of the material between rings and points; flat ends take 0.
    """
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    following = np.roll(index, -1, axis=1)
    faces = np.stack([index[:-1], following[:-1], following[1:], index[1:]], axis=-1).reshape(-1, 4).tolist()
    slots = np.broadcast_to(materials, (count - 1, around)).ravel().tolist()
    for ring in (index[0], index[-1]):
        if np.ptp(rings.reshape(-1, 3)[ring], axis=0).max() > MERGE_DISTANCE:
            faces.append(ring.tolist())
            slots.append(0)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(rings.reshape(-1, 3).tolist(), [], faces)
    mesh.polygons.foreach_set("material_index", slots)
    return _smooth(mesh)


def revolved(name: str, profile: np.ndarray, segments: int, materials: np.ndarray | int = 0) -> bpy.types.Mesh:
    """A solid of revolution about z.

    Args:
        profile: (P, 2) radius and height along the outline, from the axis or a flat end to another.
        segments: faces around the axis.
        materials: broadcast to (P − 1,), index of the material of each piece of the outline.
    """
    angle = np.arange(segments) * (2.0 * math.pi / segments)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    heights = np.broadcast_to(profile[:, None, 1:], (len(profile), segments, 1))
    rings = np.concatenate([profile[:, None, :1] * ring, heights], axis=-1)
    return swept(name, rings, np.asarray(materials)[..., None])


def ball(radius: float) -> np.ndarray:
    """Outline of a ball around the origin."""
    angle = np.linspace(0.0, math.pi, 96)
    outline = radius * np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
    outline[[0, -1], 0] = 0.0
    return outline


def drum(radius: float, height: float) -> np.ndarray:
    """Outline of an upright cylinder that stands on the origin."""
    return np.array([[0.0, 0.0], [radius, 0.0], [radius, height], [0.0, height]])


def _smooth(mesh: bpy.types.Mesh) -> bpy.types.Mesh:
    """Merge the points of poles, turn all faces outward, and smooth."""
    shape = bmesh.new()
    shape.from_mesh(mesh)
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=MERGE_DISTANCE)
    bmesh.ops.recalc_face_normals(shape, faces=shape.faces)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=EDGE_ANGLE)
    return mesh
