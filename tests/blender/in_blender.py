"""Measurements that need bpy, run by the tests in a process of its own: `in_blender.py FOLDER NAME…`."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np
import torch
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

from rgspipe.blender import blend
from rgspipe.blender.geometry import FreeSpace, scene_geometry
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.materials import diffuse_material
from rgspipe.blender.meshes import add, polygon
from rgspipe.blender.models import cornell
from rgspipe.blender.passes import Studio
from rgspipe.blender.plan import Frame
from rgspipe.datasets.named_cameras import write_cameras
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.models import CornellBox


def _quad(scene: bpy.types.Scene, half: float, height: float, albedo: tuple[float, float, float]) -> None:
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    add(scene, polygon("quad", [(x, y, height) for x, y in corners]), diffuse_material("quad", albedo))


def _frame(name: str, origin: tuple, height: float, seed: int) -> Frame:
    pose = look_at(torch.tensor(origin), torch.zeros(3))
    camera = Camera.from_field_of_view(pose, 1.0, 16, 16)
    light = PointLight(torch.tensor([0.1, -0.2, height]).double(), torch.tensor([0.5, 1.0, 2.0]).double())
    return Frame(name, camera, (light,), seed, True)


def plane(folder: Path) -> None:
    """A diffuse plane under a coloured light: from above, again, and from below with the light below."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _quad(bpy.context.scene, 4.0, 0.0, (0.2, 0.5, 0.8))
    studio = Studio(bpy.context.scene, RenderSettings(16, 2048, denoise=False, max_bounces=12), folder)
    studio.render(_frame("above", (0.5, -1.0, 1.5), 0.9, seed=1), folder)
    studio.render(_frame("below", (0.5, -1.0, -1.5), -0.9, seed=2), folder)
    studio.render(_frame("again", (0.5, -1.0, 1.5), 0.9, seed=1), folder)


def free_space(folder: Path) -> None:
    """Which of these places are free in the Cornell box, and in a closed room with a box in it."""
    space = FreeSpace(scene_geometry(cornell.build(CornellBox())))
    points = {
        "middle": (0, 0, 0.3),
        "in the tall box": (-0.17, 0.12, -0.2),
        "outside": (0, 0, 3),
        "in front": (0, -0.6, 0),
    }
    in_cornell = [space.contains(np.array(point, float)) for point in points.values()]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    bpy.context.object.data.flip_normals()
    bpy.ops.mesh.primitive_cube_add(size=0.3, location=(0.2, 0.0, 0.0))
    bpy.context.view_layer.update()
    space = FreeSpace(scene_geometry(bpy.context.scene))
    inside = [space.contains(np.array(point)) for point in ((-0.3, 0.0, 0.0), (0.2, 0.0, 0.0))]
    np.savez(folder / "free.npz", cornell=in_cornell, closed=inside, is_room=space.is_room)


def save_blends(folder: Path) -> None:
    """Three files: nothing in it, a bare scene, and the same scene with everything that must be removed."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "empty.blend"))
    _quad(bpy.context.scene, 4.0, 1.0, (0.5, 0.5, 0.5))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=(1.0, 0.5, 2.5))
    material = bpy.data.materials.new("principled")
    bpy.context.object.data.materials.append(material)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "bare.blend"))
    material.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 7.0
    bpy.ops.object.light_add(type="SUN", location=(0, 0, 9))
    bpy.ops.object.camera_add(location=(0, -9, 3))
    world = bpy.data.worlds.new("bright")
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 3.0
    bpy.context.scene.world = world
    bpy.context.scene.render.resolution_percentage = 50
    bpy.context.scene.cycles.film_exposure = 4.0
    bpy.ops.mesh.primitive_cube_add(size=9.0)
    bpy.context.object.hide_render = True
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "lit.blend"))


def normalise(folder: Path) -> None:
    """Bounds and scale of a normalised file."""
    found = blend.open_blend(folder / "lit.blend")
    geometry, world = found.geometry, found.world
    np.savez(folder / "normal.npz", lo=geometry.lo, hi=geometry.hi, rescale=world.rescale, offset=world.offset)


def own_cameras(folder: Path) -> None:
    """Cameras of a file, and where Blender itself has points of its floor in images of two sizes through each."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _quad(scene, 4.0, 1.0, (0.5, 0.5, 0.5))
    for index, fit in enumerate(("AUTO", "HORIZONTAL", "VERTICAL")):
        lens = bpy.data.cameras.new(fit)
        lens.sensor_fit, lens.shift_x, lens.shift_y, lens.lens, lens.sensor_height = fit, 0.1, -0.05, 30.0, 20.0
        item = bpy.data.objects.new(fit, lens)
        item.location, item.rotation_euler, item.scale = (1.0, -6.0, 4.0 + index), (1.0, 0.1, 0.2), (2.0, 2.0, 2.0)
        scene.collection.objects.link(item)
    flat = bpy.data.objects.new("flat", bpy.data.cameras.new("flat"))
    flat.data.type = "ORTHO"
    scene.collection.objects.link(flat)
    bpy.context.view_layer.update()
    points, pixels = np.array([[x, y, 1.0] for x in (-1.0, 0.5) for y in (-0.5, 2.0)]), {}
    for width, height in ((64, 48), (48, 64)):
        scene.render.resolution_x, scene.render.resolution_y = width, height
        for item in (one for one in scene.objects if one.type == "CAMERA" and one is not flat):
            seen = np.array([world_to_camera_view(scene, item, Vector(point)) for point in points])
            pixels[f"{item.name} {width} {height}"] = np.stack([seen[:, 0] * width, (1 - seen[:, 1]) * height], axis=1)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"))
    found = blend.open_blend(folder / "room.blend")
    write_cameras(folder / "cameras.json", found.cameras)
    np.savez(folder / "pixels.npz", points=(points + found.world.offset) * found.world.rescale, **pixels)
    (folder / "remarks.txt").write_text("\n".join(found.remarks))


def save_house(folder: Path) -> None:
    """Two files: plain.blend of diffuse surfaces, and house.blend with what no surfel can be."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _quad(bpy.context.scene, 2.0, 0.0, (0.5, 0.5, 0.5))
    # On no surface, or behind no output: neither counts.
    unused = bpy.data.materials.new("unused")
    unused.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    bpy.data.materials["quad"].node_tree.nodes.new("ShaderNodeBsdfGlass")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "plain.blend"))
    for index, name in enumerate(("window", "tap", "panel", "smoke", "thin")):
        bpy.ops.mesh.primitive_cube_add(size=0.5, location=(index - 2.0, 0.0, 0.5))
        bpy.context.object.data.materials.append(_house_material(name))
    bpy.ops.object.light_add(type="SUN", location=(0, 0, 9))
    bpy.ops.object.light_add(type="AREA", location=(0, 0, 3))
    bpy.ops.object.light_add(type="AREA", location=(0, 1, 3))
    bpy.context.scene.world = bpy.data.worlds.new("sky")
    bpy.ops.object.volume_add(location=(0, 0, 0))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "house.blend"))


def _house_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    plain, output = tree.nodes["Principled BSDF"], tree.nodes["Material Output"]
    if name == "window":
        # In a group, as material libraries have it.
        group = bpy.data.node_groups.new("pane", "ShaderNodeTree")
        group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
        glass, end = group.nodes.new("ShaderNodeBsdfGlass"), group.nodes.new("NodeGroupOutput")
        group.links.new(glass.outputs[0], end.inputs[0])
        pane = tree.nodes.new("ShaderNodeGroup")
        pane.node_tree = group
        tree.links.new(pane.outputs[0], output.inputs["Surface"])
    elif name == "tap":
        plain.inputs["Metallic"].default_value = 0.8
    elif name == "panel":
        plain.inputs["Emission Strength"].default_value = 3.0
    elif name == "smoke":
        fog = tree.nodes.new("ShaderNodeVolumeScatter")
        tree.links.new(fog.outputs[0], output.inputs["Volume"])
    else:
        plain.inputs["Alpha"].default_value = 0.5
    return material


if __name__ == "__main__":
    measurements = {one.__name__: one for one in (plane, free_space, save_blends, save_house, normalise, own_cameras)}
    for name in sys.argv[2:]:
        measurements[name](Path(sys.argv[1]))
