"""A user's .blend file as a scene of bare surfaces in the unit cube.

The meshes that a render shows are copied into a scene of their own. So nothing else of the file can change a
number: no lights, cameras, world, compositing, animation, render settings or view layers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from rgspipe.blender.left_out import left_out
from rgspipe.blender.own_cameras import image_distortion, own_cameras
from rgspipe.blender.rendered import Surface, rendered_surfaces
from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.limits import FARTHEST
from rgspipe.datasets.named_cameras import NamedCamera
from rgspipe.errors import InputError

#: The smallest extent of a scene, its units: even an atom is larger, in metres.
SMALLEST_SCENE = 1e-10

#: Sockets by which a surface or a volume glows, by node type, and what turns them off.
GLOWING_SOCKETS = {
    "EMISSION": ("Strength",),
    "BSDF_PRINCIPLED": ("Emission Strength",),
    "PRINCIPLED_VOLUME": ("Emission Strength", "Blackbody Intensity"),
    "EEVEE_SPECULAR": ("Emissive Color",),
}


@dataclass(frozen=True)
class Normalised:
    """A new scene with the surfaces of a .blend file, centred at the origin, longest side 1.

    Attributes:
        scene: it.
        rescale, offset: a point x of the file became (x + offset) · rescale.
        remarks: sentences about what of the file is left out or not modelled.
        cameras: the file's own, by name.
    """

    scene: bpy.types.Scene
    rescale: float
    offset: tuple[float, float, float]
    remarks: list[str]
    cameras: dict[str, NamedCamera]


def open_normalised(path: str | Path) -> Normalised:
    """The surfaces of a .blend file, and what of its own they were.

    Raises:
        InputError: no such file, not a .blend file, or one without a surface to render, too small, or too far away.
    """
    path = Path(path)
    _open(path)
    source, layer = bpy.context.scene, bpy.context.view_layer
    distortion = image_distortion(source)
    surfaces = rendered_surfaces(source, layer)
    if not surfaces:
        raise InputError(
            path,
            expected=f'meshes in its scene "{source.name}"',
            found="none that is rendered",
            remedy="Add an object with faces, or show the hidden ones in renders.",
        )
    remarks = left_out(source, layer, surfaces)
    lo, hi = _bounds(surfaces)
    _require_extent(path, lo, hi)
    rescale, offset = 1.0 / float((hi - lo).max()), -0.5 * (lo + hi)
    _show_cameras(source)
    cameras, others = own_cameras(source, rescale, tuple(offset.tolist()), distortion)
    scene = bpy.data.scenes.new("surfaces")
    bpy.context.window.scene = scene
    for index, surface in enumerate(surfaces):
        item = bpy.data.objects.new(f"surface_{index}", surface.mesh)
        # What mirrors a mesh stays the object's, as Blender knows then where its front faces and normals are.
        item.scale.x = math.copysign(1.0, surface.pose.determinant())
        mirror = Matrix.Scale(item.scale.x, 4, (1.0, 0.0, 0.0))
        surface.mesh.transform(mirror @ Matrix.Scale(rescale, 4) @ Matrix.Translation(offset) @ surface.pose)
        scene.collection.objects.link(item)
    _stand_still(scene, source)
    remove_emission()
    bpy.context.view_layer.update()
    return Normalised(scene, rescale, tuple(offset.tolist()), [*remarks, *others], cameras)


def _stand_still(scene: bpy.types.Scene, source: bpy.types.Scene) -> None:
    """Have `scene` stand where `source` does, and no material change any more."""
    scene.frame_set(source.frame_current, subframe=source.frame_subframe)
    for tree in _trees():
        tree.animation_data_clear()


def _trees() -> list[bpy.types.NodeTree]:
    """Those of all materials, and all groups."""
    own = [material.node_tree for material in bpy.data.materials if material.node_tree is not None]
    return [*own, *bpy.data.node_groups]


def remove_emission() -> None:
    """No material of the open file glows any more."""
    for tree in _trees():
        for node in tree.nodes:
            for name in GLOWING_SOCKETS.get(node.type, ()):
                _set_to_zero(tree, node, name)


def _set_to_zero(tree: bpy.types.NodeTree, node: bpy.types.Node, name: str) -> None:
    socket = node.inputs.get(name)
    if socket is None:
        return
    for link in list(socket.links):
        tree.links.remove(link)
    socket.default_value = 0.0 if socket.type == "VALUE" else (0.0, 0.0, 0.0, 1.0)


def _open(path: Path) -> None:
    input_file(path, "a .blend file")
    try:
        # Scripts in the file stay off: it is data.
        bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False, load_ui=False)
    except RuntimeError as error:
        found = f"something that Blender cannot open ({str(error).strip()})"
        raise InputError(path, expected="a .blend file", found=found, remedy="Save it again with Blender.") from error


def _show_cameras(scene: bpy.types.Scene) -> None:
    """Have Blender know where all cameras are: of what the viewport hides it knows nothing."""
    direct = set(scene.collection.objects)
    for item in list(scene.objects):
        is_camera = item.type == "CAMERA"
        item.hide_viewport = not is_camera
        if is_camera and item not in direct:
            scene.collection.objects.link(item)
    bpy.context.view_layer.update()


def _require_extent(path: Path, lo: np.ndarray, hi: np.ndarray) -> None:
    """Blender's own numbers, of single precision, hold neither the faces of what is smaller nor places further away."""
    longest, farthest = float((hi - lo).max()), float(np.maximum(-lo, hi).max())
    if not (longest >= SMALLEST_SCENE and farthest <= FARTHEST):
        raise InputError(
            path,
            expected=f"a scene of {SMALLEST_SCENE:g} units at least, no further than {FARTHEST:g} from the origin",
            found=f"its longest side {longest:g}, its farthest point {farthest:g} away",
            remedy="Scale or move all of it in Blender, or correct the mesh that is too large or too far away.",
        )


def _bounds(surfaces: Sequence[Surface]) -> tuple[np.ndarray, np.ndarray]:
    points = []
    for surface in surfaces:
        local = np.empty(3 * len(surface.mesh.vertices), np.float32)
        surface.mesh.vertices.foreach_get("co", local)
        pose = np.array(surface.pose)
        points.append(local.reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3])
    stacked = np.concatenate(points)
    return stacked.min(axis=0), stacked.max(axis=0)
