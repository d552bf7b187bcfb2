"""Run in a process of its own by test_lamp.py: the plane under a point light, our spots, and Blender's."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import bpy
import torch
from mathutils import Vector
from torch import Tensor

from rgspipe.blender import passes
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.lamp import place_lamp
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, polygon
from rgspipe.blender.passes import Studio
from rgspipe.blender.plan import Frame
from rgspipe.errors import InputError
from rgspipe.scene import Light, PointLight, SpotLight
from rgspipe.scene.lights import Nodes
from spots_on_plane import ALBEDO, SIZE, hard_spots, lopsided_luminaire, plane_camera, plane_lights, yellow_lights

SAMPLES = 1024


class Tube(PointLight):
    """Two points side by side, which Blender has no lamp for."""

    kind = "tube"

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        return Nodes(values["position"] + torch.tensor([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]).to(values["position"]))


def _render(studio: Studio, name: str, light: Light, folder: Path) -> None:
    studio.render(Frame(name, plane_camera(), (light,), 1, False), folder)


def _blender_s_spot(lamp: bpy.types.Object, spot: SpotLight) -> None:
    """Give `lamp` Blender's spot of the same cone, in the place of ours."""
    place_lamp(lamp, PointLight(spot.position, spot.intensity))
    lamp.data.type = "SPOT"
    lamp.data.spot_size, lamp.data.spot_blend = 2.0 * spot.cone_angle, spot.falloff
    lamp.rotation_mode = "QUATERNION"
    lamp.rotation_quaternion = Vector(spot.direction.tolist()).to_track_quat("-Z", "Y")


def main(folder: Path) -> None:
    """Every light, the first one again, and Blender's own spot of the smoothstep's cone."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    corners = [(-4.0, -4.0, 0.0), (4.0, -4.0, 0.0), (4.0, 4.0, 0.0), (-4.0, 4.0, 0.0)]
    add(bpy.context.scene, polygon("plane", corners), diffuse_material("plane", ALBEDO))
    studio = Studio(bpy.context.scene, RenderSettings(SIZE, SAMPLES, denoise=False, max_bounces=0), folder)
    lights = plane_lights()
    for name, light in (lights | hard_spots() | yellow_lights() | {"luminaire": lopsided_luminaire()}).items():
        _render(studio, name, light, folder)
    _render(studio, "again", lights["point"], folder)
    dark = bpy.data.objects.new("dark", bpy.data.lights.new("dark", "POINT"))
    place_lamp(dark, PointLight([0.0, 0.0, 1.0], 0.0))
    (folder / "dark.txt").write_text(f"{dark.data.energy} {list(dark.data.color)}")
    try:
        place_lamp(bpy.data.objects.new("tube", None), Tube([0.0, 0.0, 1.0], 1.0))
    except InputError as error:
        (folder / "refused.txt").write_text(str(error))
    spot = lights["smoothstep"]
    passes.place_lamp = _blender_s_spot
    _render(studio, "blender", spot, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
