"""The surfaces of the open file as a render shows them, which Blender works out for render engines alone.

The viewport may show less, coarser or other things: modifiers, levels of subdivision, curves, instances and whole
objects have settings for it of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import bpy
from mathutils import Matrix

#: The smallest width and height of an image that Blender renders, pixels.
SMALLEST = 4


@dataclass(frozen=True)
class Surface:
    """Faces that are rendered.

    Attributes:
        mesh: a copy of them that nothing else of the file can change.
        pose: of the mesh.
        item: the object that they are of; instances have one together.
    """

    mesh: bpy.types.Mesh
    pose: Matrix
    item: bpy.types.Object


def rendered_surfaces(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> list[Surface]:
    """All meshes with faces that a render of the open scene shows (curves, texts and instances too).

    The scene's settings for renders are changed for it.
    """
    _Taker.wanted, _Taker.taken, _Taker.failure = layer.name, None, None
    bpy.utils.register_class(_Taker)
    stand_in = _prepare(scene, layer)
    try:
        bpy.ops.render.render()
    finally:
        if stand_in is not None:
            bpy.data.cameras.remove(stand_in)
        bpy.utils.unregister_class(_Taker)
    if _Taker.failure is not None:
        raise _Taker.failure
    return _Taker.taken or []


class _Taker(bpy.types.RenderEngine):
    """An engine that takes the surfaces, and makes no picture of them."""

    bl_idname = "RGSPIPE_TAKER"
    bl_label = "Surfaces for rgspipe"

    wanted: ClassVar[str]
    taken: ClassVar[list[Surface] | None]
    failure: ClassVar[Exception | None]

    def render(self, graph: bpy.types.Depsgraph) -> None:
        if graph.view_layer.name != self.wanted:
            return
        try:
            _Taker.taken = list(_surfaces(graph))
        except Exception as error:  # Blender would print it and go on
            _Taker.failure = error


def _prepare(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bpy.types.Camera | None:
    """Have a render call our engine, once, and do nothing else; the camera that it got, as Blender insists on one."""
    render = scene.render
    render.engine = _Taker.bl_idname
    render.resolution_x = render.resolution_y = SMALLEST
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = render.use_border = render.use_multiview = False
    for one in scene.view_layers:
        one.use = one == layer
    if scene.camera is not None:
        return None
    camera = bpy.data.cameras.new("stand-in")
    scene.camera = bpy.data.objects.new("stand-in", camera)
    scene.collection.objects.link(scene.camera)
    return camera


def _surfaces(graph: bpy.types.Depsgraph) -> Iterator[Surface]:
    for instance in graph.object_instances:
        item = instance.object
        # The faces of curves, texts and balls are meshes beside them, as Blender tells them to engines.
        if item.type != "MESH" or not instance.show_self:
            continue
        mesh = _copied(instance, graph)
        if len(mesh.polygons):
            _take_materials(mesh, item)
            yield Surface(mesh, instance.matrix_world.copy(), item.original)


def _copied(instance: bpy.types.DepsgraphObjectInstance, graph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """Its faces. Those of geometry nodes may be no object's: of their object Blender gives the instancer's."""
    item = instance.object
    if instance.is_instance:
        return item.data.copy()
    return bpy.data.meshes.new_from_object(item, preserve_all_data_layers=True, depsgraph=graph)


def _take_materials(mesh: bpy.types.Mesh, item: bpy.types.Object) -> None:
    """Materials may hang on the object instead of its mesh; by name they are not told apart, as libraries have any."""
    for index, slot in enumerate(item.material_slots):
        if slot.material is not None and index < len(mesh.materials):
            mesh.materials[index] = slot.material.original
