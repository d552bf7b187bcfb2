"""Open the scene of a job: geometry in the unit cube, and the layout of cameras and lights that suits it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import bpy

from rgspipe.blender import blend
from rgspipe.blender.cameras import Layout, ObjectLayout, RoomLayout
from rgspipe.blender.geometry import FreeSpace, Geometry, scene_geometry
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.models import cornell, corner, hotdog, room, zoo
from rgspipe.blender.models.parameters import BlendFile, kind_of
from rgspipe.blender.passes import HERE
from rgspipe.datasets.named_cameras import NamedCamera
from rgspipe.light_export.world import World

#: The scenes that are modelled here.
MODELS = {"cornell": cornell, "corner": corner, "hotdog": hotdog, "room": room, "zoo": zoo}


@dataclass(frozen=True)
class PreparedScene:
    """A scene without lights and cameras, ready to be rendered.

    Attributes:
        scene: Blender's scene.
        geometry: its surfaces.
        layout: draws cameras and lights.
        world: how the coordinates of what Blender renders become the scene's.
        remarks: sentences about what of the original is left out or not modelled.
        cameras: of the original, by name.
    """

    scene: bpy.types.Scene
    geometry: Geometry
    layout: Layout
    world: World = HERE
    remarks: Sequence[str] = ()
    cameras: Mapping[str, NamedCamera] = field(default_factory=dict)


def open_scene(job: DatasetJob) -> PreparedScene:
    """Build or open the scene of `job`.

    Raises:
        InputError: the .blend file is missing, not one, or has no surface to render.
    """
    if isinstance(job.model, BlendFile):
        return _open_file(job.model, job.resolution)
    model = MODELS[kind_of(job.model)]
    scene = model.build(job.model)
    geometry = scene_geometry(scene)
    layout = model.layout(job.model, FreeSpace(geometry), job.resolution)
    return PreparedScene(scene, geometry, layout)


def _open_file(file: BlendFile, resolution: int) -> PreparedScene:
    found = blend.open_blend(file.path)
    space = FreeSpace(found.geometry)
    layout = RoomLayout(space, resolution) if space.is_room else ObjectLayout(space, resolution)
    return PreparedScene(found.scene, found.geometry, layout, found.world, found.remarks, found.cameras)
