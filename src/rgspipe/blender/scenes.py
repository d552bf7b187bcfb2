"""Open the scene of a job: geometry in the unit cube, and the layout of cameras and lights that suits it."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from rgspipe.blender import blend, cornell
from rgspipe.blender.cameras import CornellLayout, Layout, ObjectLayout, RoomLayout
from rgspipe.blender.geometry import FreeSpace, Geometry, scene_geometry
from rgspipe.blender.job import DatasetJob


@dataclass(frozen=True)
class PreparedScene:
    """A scene without lights and cameras, ready to be rendered.

    Attributes:
        scene: Blender's scene.
        geometry: its surfaces.
        layout: draws cameras and lights.
        rescale, offset: how the original coordinates became the scene's: (x + offset) · rescale.
    """

    scene: bpy.types.Scene
    geometry: Geometry
    layout: Layout
    rescale: float
    offset: tuple[float, float, float]


def open_scene(job: DatasetJob) -> PreparedScene:
    """Build or open the scene of `job`.

    Raises:
        InputError: the .blend file is missing, not one, or has no surface to render.
    """
    if job.kind == "cornell":
        scene, rescale, offset = cornell.build(job.cornell), 1.0, (0.0, 0.0, 0.0)
    else:
        scene, rescale, offset = blend.open_normalised(job.blend_path)
    geometry = scene_geometry(scene)
    space = FreeSpace(geometry)
    if job.kind == "cornell":
        layout: Layout = CornellLayout(space, job.resolution)
    else:
        layout = (RoomLayout if space.is_room else ObjectLayout)(space, job.resolution)
    return PreparedScene(scene, geometry, layout, rescale, offset)
