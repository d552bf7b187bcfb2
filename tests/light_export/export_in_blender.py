"""Run in a process of its own by test_in_blender.py: exported scripts on a plane, in metres."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import bpy
import torch

from rgspipe.blender import passes
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, polygon
from rgspipe.blender.plan import Frame
from rgspipe.scene import Camera
from spots_on_plane import ALBEDO, SIZE, plane_camera, plane_lights

SAMPLES = 1024


def main(folder: Path, metres: float) -> None:
    """An image of each script's lamp, and one file saved."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    corners = [(x * metres, y * metres, 0.0) for x, y in ((-4, -4), (4, -4), (4, 4), (-4, 4))]
    add(bpy.context.scene, polygon("plane", corners), diffuse_material("plane", ALBEDO))
    studio = passes.Studio(bpy.context.scene, RenderSettings(SIZE, SAMPLES, denoise=False, max_bounces=0), folder)
    passes.place_lamp = lambda item, light: setattr(item, "hide_render", True)
    camera = plane_camera()
    pose = camera.camera_to_world.double().clone()
    pose[:3, 3] *= metres
    camera = Camera(pose, camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height)
    before = {*bpy.data.objects}
    for name, light in plane_lights().items():
        sys.argv = ["blender", "--", str(folder / "saved.blend")] if name == "point" else ["blender"]
        runpy.run_path(str(folder / name / "lamps_blender.py"))
        studio.render(Frame(name, camera, (light,), 1, False), folder)
        for item in {*bpy.data.objects} - before:
            bpy.data.objects.remove(item)


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(Path(sys.argv[1]), float(sys.argv[2]))
