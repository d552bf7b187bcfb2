"""A user's .blend file as a scene of bare surfaces, which stay where and what they are in the file.

Its own scene is rendered, at its own size: materials may go by anything that a file knows of an object (its pose, its
own coordinates, its number, lengths of bumps, reliefs and fogs). Nothing else of the file can change a number: lights
and worlds are dark, and render settings are Blender's own, then ours.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from rgspipe.blender.geometry import Geometry
from rgspipe.blender.left_out import DRAWINGS, RAYS, left_out
from rgspipe.blender.own_cameras import cut_off, image_distortion, own_cameras
from rgspipe.blender.own_renders import differences, not_taken
from rgspipe.blender.rendered import Surface, rendered_surfaces
from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.limits import FARTHEST
from rgspipe.datasets.named_cameras import NamedCamera
from rgspipe.errors import InputError
from rgspipe.light_export.world import World

#: The smallest extent of a scene, its units: of one of 1e-6 Cycles loses the faces (5.0), and its cameras cut off what
#: is nearer than 1e-6.
SMALLEST_SCENE = 1e-4

#: Sockets by which a surface or a volume glows, by node type.
GLOWING_SOCKETS = {
    "EMISSION": ("Strength",),
    "BSDF_PRINCIPLED": ("Emission Strength",),
    "PRINCIPLED_VOLUME": ("Emission Strength", "Blackbody Intensity"),
    "VOLUME_COEFFICIENTS": ("Emission Coefficients",),
    "EEVEE_SPECULAR": ("Emissive Color",),
}

#: Settings of renders that make the surfaces what they are.
KEPT = {
    "use_simplify", "simplify_subdivision_render", "simplify_child_particles_render", "hair_type", "hair_subdiv",
    "fps", "fps_base", "frame_map_old", "frame_map_new",
}  # fmt: skip
KEPT_OF_CYCLES = {
    "feature_set", "dicing_rate", "offscreen_dicing_scale", "max_subdivisions", "dicing_camera", "texture_limit_render",
}  # fmt: skip


@dataclass(frozen=True)
class Opened:
    """A .blend file whose scene has its surfaces alone.

    Attributes:
        scene: its own.
        world: how its coordinates are brought to a scene's, which is centred at the origin, its longest side 1.
        geometry: the surfaces, in scene units.
        remarks: sentences about what of the file is left out or not modelled.
        cameras: the file's own, by name.
    """

    scene: bpy.types.Scene
    world: World
    geometry: Geometry
    remarks: list[str]
    cameras: dict[str, NamedCamera]


def open_blend(path: str | Path) -> Opened:
    """The surfaces of a .blend file, and what of its own they were.

    Raises:
        InputError: no such file, not a .blend file, or one without a surface to render, too small, or too far away.
    """
    path = Path(path)
    _open(path)
    scene, layer = bpy.context.scene, bpy.context.view_layer
    distortion, differ, others = image_distortion(scene), differences(scene), not_taken(scene, layer)
    surfaces = rendered_surfaces(scene, layer)
    if not surfaces:
        raise InputError(
            path,
            expected=f'meshes in its scene "{scene.name}"',
            found="none that is rendered",
            remedy="Add an object with faces, or show the hidden ones in renders.",
        )
    remarks = [*others, *left_out(scene, layer, surfaces)]
    lo, hi = _bounds(surfaces)
    _require_extent(path, lo, hi)
    world = World(rescale=1.0 / float((hi - lo).max()), offset=tuple((-0.5 * (lo + hi)).tolist()))
    _show_cameras(scene)
    cameras, said = own_cameras(scene, world.rescale, world.offset, distortion)
    geometry = _geometry(surfaces, world)
    remarks += [*said, *cut_off(scene, cameras, geometry, world), *(differ if cameras else [])]
    _leave_surfaces_alone(scene, layer)
    return Opened(scene, world, geometry, remarks, cameras)


def _geometry(surfaces: Sequence[Surface], world: World) -> Geometry:
    points = np.concatenate([one.points for one in surfaces])
    starts = np.cumsum([0, *(len(one.points) for one in surfaces[:-1])])
    triangles = np.concatenate([one.triangles + start for one, start in zip(surfaces, starts, strict=True)])
    # Blender's tree is of single precision: bounds that are not would lie beside its faces.
    placed = ((points + np.array(world.offset)) * world.rescale).astype(np.float32)
    return Geometry(placed.astype(np.float64), triangles)


def _leave_surfaces_alone(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
    """Have nothing shine, every surface be one like any other, and renders of `scene` have no settings of its own."""
    remove_emission()
    for lamp in bpy.data.lights:
        lamp.animation_data_clear()
        lamp.energy = 0.0
    for item in bpy.data.objects:
        item.is_holdout = item.is_shadow_catcher = False
        for ray in RAYS:
            setattr(item, f"visible_{ray}", True)
        item.hide_render |= item.type in {"LIGHT", *DRAWINGS}
    for collection in _collections(layer.layer_collection):
        collection.holdout = collection.indirect_only = False
    for other in [one for one in scene.view_layers if one != layer]:
        scene.view_layers.remove(other)
    # Markers switch cameras, and keys turn settings.
    scene.timeline_markers.clear()
    scene.animation_data_clear()
    _reset(scene.render, KEPT)
    _reset(scene.render.image_settings)
    _reset(scene.cycles, KEPT_OF_CYCLES)
    _reset(layer, {"name", "material_override"})
    _reset(layer.cycles)


def _reset(settings: bpy.types.bpy_struct, kept: set[str] = frozenset()) -> None:
    for entry in settings.bl_rna.properties:
        if not entry.is_readonly and entry.identifier not in kept:
            settings.property_unset(entry.identifier)


def _collections(root: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    yield root
    for child in root.children:
        yield from _collections(child)


def remove_emission() -> None:
    """No material of the open file glows any more, whatever keys and drivers say."""
    materials = [material.node_tree for material in bpy.data.materials if material.node_tree is not None]
    for tree in [*materials, *bpy.data.node_groups]:
        for node in [*tree.nodes]:
            for name in GLOWING_SOCKETS.get(node.type, ()):
                if name in node.inputs:
                    tree.links.new(tree.nodes.new("ShaderNodeValue").outputs[0], node.inputs[name])


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
    lo = np.min([one.points.min(axis=0) for one in surfaces], axis=0)
    return lo, np.max([one.points.max(axis=0) for one in surfaces], axis=0)
