"""The surfaces of the open file as a render shows them, which Blender works out for render engines alone.

The viewport may show less, coarser or other things: modifiers, levels of subdivision, curves, instances and whole
objects have settings for it of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import bpy
import numpy as np

from rgspipe.blender.geometry import world_triangles

#: The smallest width and height of an image that Blender renders, pixels.
SMALLEST = 4


@dataclass(frozen=True)
class Surface:
    """Faces that are rendered.

    Attributes:
        points: (V, 3) where they are in the file.
        triangles: (T, 3) indices; a front face is counter-clockwise.
        materials: that they may have.
        item: the object that they are of; instances have one together.
    """

    points: np.ndarray
    triangles: np.ndarray
    materials: list[bpy.types.Material]
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
        points, triangles = world_triangles(item.data, instance.matrix_world)
        if len(triangles):
            yield Surface(points, triangles, _materials(item), item.original)


def _materials(item: bpy.types.Object) -> list[bpy.types.Material]:
    """Materials may hang on the object instead of its mesh."""
    slots = [slot.material for slot in item.material_slots]
    found = [*slots, *item.data.materials[len(slots) :]]
    return [material.original for material in found if material is not None]
