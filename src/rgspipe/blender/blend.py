"""A user's .blend file as a scene of bare surfaces in the unit cube.

The evaluated meshes are copied into a scene of their own. So nothing else of the file can change a
number: no lights, cameras, world, compositing, animation, render settings or view layers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from rgspipe.blender.left_out import left_out
from rgspipe.blender.own_cameras import own_cameras
from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.named_cameras import NamedCamera
from rgspipe.errors import InputError

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
        InputError: no such file, not a .blend file, or one without a surface to render.
    """
    path = Path(path)
    _open(path)
    source = bpy.context.scene
    _show_what_is_rendered(source)
    copies = list(_copy_meshes(source))
    if not copies:
        raise InputError(
            path,
            expected=f'meshes in its scene "{source.name}"',
            found="none that is rendered",
            remedy="Add an object with faces, or show the hidden ones in renders.",
        )
    remarks = left_out(source, [material for mesh, _ in copies for material in mesh.materials])
    lo, hi = _bounds(copies)
    longest = float((hi - lo).max())
    if not np.isfinite(longest) or longest <= 0:
        raise InputError(path, expected="a scene of finite size", found=f"{longest:g}", remedy="Correct its meshes.")
    rescale, offset = 1.0 / longest, -0.5 * (lo + hi)
    cameras, others = own_cameras(source, rescale, tuple(offset.tolist()))
    scene = bpy.data.scenes.new("surfaces")
    bpy.context.window.scene = scene
    for index, (mesh, matrix) in enumerate(copies):
        mesh.transform(Matrix.Scale(rescale, 4) @ Matrix.Translation(offset) @ matrix)
        scene.collection.objects.link(bpy.data.objects.new(f"surface_{index}", mesh))
    remove_emission()
    bpy.context.view_layer.update()
    return Normalised(scene, rescale, tuple(offset.tolist()), [*remarks, *others], cameras)


def remove_emission() -> None:
    """No material of the open file glows any more."""
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree is not None]
    for tree in [*trees, *bpy.data.node_groups]:
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


def _show_what_is_rendered(scene: bpy.types.Scene) -> None:
    """Make the evaluated scene hold what a render would show, not what the viewport did."""
    for collection in [scene.collection, *bpy.data.collections]:
        collection.hide_viewport = collection.hide_render
    for item in scene.objects:
        item.hide_viewport = item.hide_render
        item.hide_set(False)
    bpy.context.view_layer.update()


def _copy_meshes(scene: bpy.types.Scene) -> Iterator[tuple[bpy.types.Mesh, Matrix]]:
    """Independent copies of all evaluated meshes with faces (curves, texts and instances too), and their poses."""
    graph = bpy.context.evaluated_depsgraph_get()
    for instance in graph.object_instances:
        item = instance.object
        if item.type not in {"MESH", "CURVE", "SURFACE", "FONT", "META"} or item.hide_render or not instance.show_self:
            continue
        mesh = bpy.data.meshes.new_from_object(item, preserve_all_data_layers=True, depsgraph=graph)
        if len(mesh.polygons):
            _take_materials(mesh, item)
            yield mesh, instance.matrix_world.copy()


def _take_materials(mesh: bpy.types.Mesh, item: bpy.types.Object) -> None:
    """Materials may hang on the object instead of its mesh."""
    for index, slot in enumerate(item.material_slots):
        if slot.material is not None and index < len(mesh.materials):
            mesh.materials[index] = bpy.data.materials[slot.material.name]


def _bounds(copies: list[tuple[bpy.types.Mesh, Matrix]]) -> tuple[np.ndarray, np.ndarray]:
    points = []
    for mesh, matrix in copies:
        local = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", local)
        pose = np.array(matrix)
        points.append(local.reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3])
    stacked = np.concatenate(points)
    return stacked.min(axis=0), stacked.max(axis=0)
