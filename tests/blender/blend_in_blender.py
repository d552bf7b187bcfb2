"""What is made of .blend files, run by the tests in a process of its own: `blend_in_blender.py FOLDER NAME…`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np
import torch

from rgspipe.blender import blend, cycles
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.nodes import tree_of
from rgspipe.blender.passes import Studio
from rgspipe.blender.rendered import rendered_surfaces
from rgspipe.datasets.exr import read_channels
from rgspipe.errors import InputError
from rgspipe.scene import PointLight


def rendered_alone(folder: Path) -> None:
    """Triangles and size, of files whose viewport shows other things than a render does."""
    found = {}
    for name, build in FILES.items():
        path = folder / f"{name}.blend"
        _cube()
        build(_cube(x=3.0, fresh=False))
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))
        surfaces = rendered_surfaces(bpy.context.scene, bpy.context.view_layer)
        length = float(np.ptp(np.concatenate([one.points for one in surfaces])[:, 0]))
        found[name] = {"triangles": sum(len(one.triangles) for one in surfaces), "length": length}
    _write(folder, "rendered_alone", found)


def linked(folder: Path) -> None:
    """A red cube and a camera in a library, beside a blue cube and another camera of the same names."""
    _cube().data.materials.append(_paint((1.0, 0.0, 0.0, 1.0)))
    _camera((0.0, -5.0, 0.0))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "library.blend"))
    _cube().data.materials.append(_paint((0.0, 0.0, 1.0, 1.0)))
    _camera((9.0, -9.0, 9.0))
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, taken):
        taken.objects = ["cube", "Kitchen"]
    for item in taken.objects:
        bpy.context.scene.collection.objects.link(item)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "house.blend"))
    found = blend.open_blend(folder / "house.blend")
    paints = [item.data.materials[0].node_tree for item in found.scene.objects if item.type == "MESH"]
    colours = [list(paint.nodes["Principled BSDF"].inputs["Base Color"].default_value) for paint in paints]
    cameras = {name: (camera.pose[:3, 3] / found.world.rescale).tolist() for name, camera in found.cameras.items()}
    _write(folder, "linked", {"colours": colours, "cameras": cameras})


def hidden_cameras(folder: Path) -> None:
    """Where cameras are that the viewport, or a render, does not show, or whose collection it does not."""
    _cube()
    for index, name in enumerate(("viewport", "render", "collection", "eye")):
        item = _camera((float(index), -5.0, 0.0), name)
        item.hide_viewport, item.hide_render = name == "viewport", name == "render"
        if name == "collection":
            hidden = bpy.data.collections.new(name)
            hidden.hide_viewport = hidden.hide_render = True
            bpy.context.scene.collection.children.link(hidden)
            bpy.context.scene.collection.objects.unlink(item)
            hidden.objects.link(item)
        item.hide_set(name == "eye")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "hidden.blend"))
    found = blend.open_blend(folder / "hidden.blend")
    _write(
        folder,
        "hidden_cameras",
        {name: float(camera.pose[0, 3] / found.world.rescale) for name, camera in found.cameras.items()},
    )


def extents(folder: Path) -> None:
    """What is said of files that are too small, too large, or too far away."""
    _write(
        folder,
        "extents",
        {name: said for size, x, name in SIZES for said in _refused(folder / f"{name}.blend", size, x)},
    )


def treated(folder: Path) -> None:
    """What is said of objects with which a render does something else than to show them."""
    item = _cube("ordinary")
    for name, set_to in (("unseen", "visible_camera"), ("caught", "is_shadow_catcher"), ("held", "is_holdout")):
        item = _cube(name, 2.0, fresh=False)
        setattr(item, set_to, not getattr(item, set_to))
    out = bpy.data.collections.new("out")
    bpy.context.scene.collection.children.link(out)
    item = _cube("out", 4.0, fresh=False)
    bpy.context.scene.collection.objects.unlink(item)
    out.objects.link(item)
    bpy.context.view_layer.layer_collection.children["out"].holdout = True
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "treated.blend"))
    _write(folder, "treated", blend.open_blend(folder / "treated.blend").remarks)


def mirrored(folder: Path) -> None:
    """Whether a closed room is a room, as it is and mirrored."""
    found = {}
    for scale in (1, -1):
        item = _cube()
        item.data.flip_normals()
        item.scale.x = scale
        path = folder / f"room{scale}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        found[scale] = FreeSpace(blend.open_blend(path).geometry).is_room
    _write(folder, "mirrored", found)


def keyed(folder: Path) -> None:
    """The colour and the glow that renders have of a material with keys from frame 1 to 11, saved at 8.5."""
    _cube().data.materials.append(paint := _paint((0.0, 0.0, 0.0, 1.0)))
    inputs = tree_of(paint).nodes["Principled BSDF"].inputs
    for frame, value in ((1, 0.0), (11, 1.0)):
        inputs["Base Color"].default_value = (value, value, value, 1.0)
        inputs["Emission Strength"].default_value = value
        inputs["Base Color"].keyframe_insert("default_value", frame=frame)
        inputs["Emission Strength"].keyframe_insert("default_value", frame=frame)
    bpy.context.scene.frame_set(8, subframe=0.5)
    colour = inputs["Base Color"].default_value[0]
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "keyed.blend"))
    [item] = blend.open_blend(folder / "keyed.blend").scene.objects
    item.hide_viewport = False
    rendered = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.materials[0]
    inputs = tree_of(rendered).nodes["Principled BSDF"].inputs
    [link] = inputs["Emission Strength"].links
    found = {"colour": inputs["Base Color"].default_value[0], "glow": link.from_socket.default_value}
    _write(folder, "keyed", {"set": colour, **found})


def distorted(folder: Path) -> None:
    """The cameras of a file whose renders are not whole images of square pixels, and what is said of them."""
    found = {}
    settings = {"use_border": True, "use_crop_to_border": True}
    for name, values in {
        "wide": {"pixel_aspect_x": 2.0},
        "cropped": {**settings, "border_min_x": 0.5},
        "border": {"use_border": True, "border_min_x": 0.5},
        "whole": settings,
    }.items():
        _cube()
        _camera((0.0, -5.0, 0.0))
        for key, value in values.items():
            setattr(bpy.context.scene.render, key, value)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
        taken = blend.open_blend(folder / f"{name}.blend")
        found[name] = [[*taken.cameras], taken.remarks]
    _write(folder, "distorted", found)


def compared(folder: Path) -> None:
    """How far our images are from the file's own under its lamp, mean difference over mean, by what is in them."""
    found = {}
    for name, (kind, output, to) in MATERIALS.items():
        item = _cube(size=2.0)
        item.scale, item.rotation_euler = (1.3, 0.7, -1.1), (0.4, 0.3, 0.9)
        item.modifiers.new("finer", "SUBSURF").render_levels = 2
        item.data.materials.append(paint := _paint((0.6, 0.5, 0.4, 1.0)))
        tree = tree_of(paint)
        node = tree.nodes.new(kind)
        if kind == "ShaderNodeDisplacement":
            _link(tree, "ShaderNodeTexNoise", "Fac", node.inputs["Height"])
        tree.links.new(node.outputs[output], tree.nodes[to[0]].inputs[to[1]])
        paint.displacement_method = "DISPLACEMENT" if name == "relief" else "BUMP"
        _instance(item, (4.0, 1.0, 0.5))
        found[name] = _difference(folder / f"{name}.blend")
    _write(folder, "compared", found)


def _difference(path: Path) -> float:
    """Between the open file as its own lamp lights it, and what is made of it, saved with much that may change that."""
    _lamp((1.0, -4.0, 5.0))
    camera = _camera((1.0, -9.0, 5.0))
    camera.rotation_euler = (1.05, 0.0, 0.0)
    scene, settings = bpy.context.scene, RenderSettings(16, 4, denoise=False, max_bounces=1)
    scene.camera = camera
    own = _own_render(scene, settings, path.with_suffix(".exr"))
    scene.world = bpy.data.worlds.new("bright")
    scene.timeline_markers.new("cut", frame=1).camera = _camera((0.0, 0.0, 9.0), "other")
    scene.cycles.film_exposure, scene.render.use_motion_blur = 3.0, True
    _cube("glowing", 0.0, 1e-3, fresh=False).data.materials.append(paint := _paint((0.0, 0.0, 0.0, 1.0)))
    tree_of(paint).nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 1e6
    bpy.context.object.visible_camera = False
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    opened = blend.open_blend(path)
    unit = opened.world.unit
    place = (torch.tensor([1.0, -4.0, 5.0]) + torch.tensor(opened.world.offset)) / unit
    light = PointLight(place, torch.tensor([500.0, 400.0, 300.0]) / (4.0 * torch.pi * unit * unit))
    studio = Studio(opened.scene, settings, path.parent, opened.world)
    ours, _ = studio.radiance(opened.cameras["Kitchen"].of_image(16, 16), [light], seed=1)
    return float(abs(own - ours).mean() / own.mean())


def _own_render(scene: bpy.types.Scene, settings: RenderSettings, path: Path) -> np.ndarray:
    cycles.configure(scene, settings)
    cycles.use_colour_sampling(scene, settings.samples, denoise=False, seed=1)
    scene.cycles.property_unset("sampling_pattern")
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    channels = {tuple(name.split(".")[1:]): values for name, values in read_channels(path).items()}
    return np.stack([channels["Combined", channel] for channel in "RGB"], axis=-1)


def told(folder: Path) -> None:
    """What is said of a file whose renders are made otherwise than ours."""
    item = _cube(size=4.0)
    for name, kind, to in (("hole", "ShaderNodeHoldout", "Surface"), ("osl", "ShaderNodeScript", "Displacement")):
        item.data.materials.append(paint := bpy.data.materials.new(name))
        node, output = tree_of(paint).nodes.new(kind), tree_of(paint).nodes["Material Output"]
        socket = node.outputs[0] if node.outputs else node.outputs.new("NodeSocketVector", "out")
        tree_of(paint).links.new(socket, output.inputs[to])
    item.modifiers.new("hair", "PARTICLE_SYSTEM").particle_system.settings.type = "HAIR"
    scene, layers = bpy.context.scene, bpy.data.collections
    scene.collection.children.link(indirect := layers.new("indirect"))
    indirect.objects.link(other := _cube("indirect", 5.0, fresh=False))
    scene.collection.objects.unlink(other)
    bpy.context.view_layer.layer_collection.children["indirect"].indirect_only = True
    for name in ("mirrored", "clipped", "blurred"):
        camera = _camera((0.0, 0.0, 12.0), name)
        camera.scale.x = -1.0 if name == "mirrored" else 1.0
        camera.data.clip_start = 11.0 if name == "clipped" else 0.1
        camera.data.dof.use_dof = name == "blurred"
    _lamp((0.0, 0.0, 5.0)).light_linking.receiver_collection = layers.new("lit")
    bpy.data.scenes.new("garden")
    scene.view_layers.new("other")
    scene.render.engine, scene.render.use_motion_blur = "CYCLES", True
    scene.compositing_node_group = bpy.data.node_groups.new("composited", "CompositorNodeTree")
    for key, value in SETTINGS.items():
        setattr(scene.cycles, key, value)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "told.blend"))
    _write(folder, "told", blend.open_blend(folder / "told.blend").remarks)


def _lamp(place: tuple[float, float, float]) -> bpy.types.Object:
    item = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    item.location, item.data.energy, item.data.color = place, 500.0, (1.0, 0.8, 0.6)
    item.data.shadow_soft_size, item.data.use_soft_falloff = 0.0, False
    bpy.context.scene.collection.objects.link(item)
    return item


def _instance(item: bpy.types.Object, place: tuple[float, float, float]) -> None:
    """Another one of `item`, smaller, as an instance of a collection."""
    group = bpy.data.collections.new("group")
    group.objects.link(item)
    shown = bpy.data.objects.new("shown", None)
    shown.instance_type, shown.instance_collection = "COLLECTION", group
    shown.location, shown.scale = place, (0.7, 0.7, 0.7)
    bpy.context.scene.collection.objects.link(shown)


def _link(tree: bpy.types.NodeTree, kind: str, output: str, socket: bpy.types.NodeSocket) -> None:
    tree.links.new(tree.nodes.new(kind).outputs[output], socket)


def _cube(name: str = "cube", x: float = 0.0, size: float = 1.0, fresh: bool = True) -> bpy.types.Object:
    if fresh:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add(size=size, location=(x, 0.0, 0.0))
    bpy.context.object.name = name
    return bpy.context.object


def _camera(place: tuple[float, float, float], name: str = "Kitchen") -> bpy.types.Object:
    item = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    item.location = place
    bpy.context.scene.collection.objects.link(item)
    return item


def _paint(colour: tuple[float, float, float, float]) -> bpy.types.Material:
    material = bpy.data.materials.new("Paint")
    tree_of(material).nodes["Principled BSDF"].inputs["Base Color"].default_value = colour
    return material


def _refused(path: Path, size: float, x: float) -> Iterator[str]:
    _cube(size=size, x=x)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    try:
        blend.open_blend(path)
    except InputError as error:
        yield str(error)


def _write(folder: Path, name: str, found: object) -> None:
    (folder / f"{name}.json").write_text(json.dumps(found))


def _subdivided(item: bpy.types.Object) -> None:
    modifier = item.modifiers.new("finer", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 3


def _repeated(in_viewport: bool) -> Callable[[bpy.types.Object], None]:
    def build(item: bpy.types.Object) -> None:
        modifier = item.modifiers.new("row", "ARRAY")
        modifier.count, modifier.show_viewport, modifier.show_render = 5, in_viewport, not in_viewport

    return build


def _instanced(item: bpy.types.Object) -> None:
    """A small cube at each corner of the second one, which renders do not show."""
    small = _cube("small", 3.0, 0.1, fresh=False)
    small.parent, item.instance_type = item, "VERTS"
    item.show_instancer_for_render = False


def _scattered(item: bpy.types.Object) -> None:
    """The second cube as geometry nodes make it: itself, and at its corners a small cube that is no object."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeMeshCube", "GeometryNodeInstanceOnPoints")
    taken, given, small, placed = (tree.nodes.new(kind) for kind in kinds)
    both = tree.nodes.new("GeometryNodeJoinGeometry")
    small.inputs["Size"].default_value = (0.1, 0.1, 0.1)
    tree.links.new(taken.outputs[0], placed.inputs["Points"])
    tree.links.new(small.outputs["Mesh"], placed.inputs["Instance"])
    tree.links.new(placed.outputs[0], both.inputs[0])
    tree.links.new(taken.outputs[0], both.inputs[0])
    tree.links.new(both.outputs[0], given.inputs[0])
    item.modifiers.new("scatter", "NODES").node_group = tree


def _collected(item: bpy.types.Object) -> None:
    """The second cube, subdivided as by `_subdivided`, as an instance of a collection that is not shown itself."""
    _subdivided(item)
    hidden = bpy.data.collections.new("hidden")
    hidden.objects.link(item)
    bpy.context.scene.collection.objects.unlink(item)
    shown = bpy.data.objects.new("shown", None)
    shown.instance_type, shown.instance_collection = "COLLECTION", hidden
    bpy.context.scene.collection.objects.link(shown)


def _ball(item: bpy.types.Object) -> None:
    """A NURBS ball instead of the second cube: in Blender there is a mesh of it beside it."""
    bpy.data.objects.remove(item)
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(3.0, 0.0, 0.0))


def _hidden_in_viewport(item: bpy.types.Object) -> None:
    item.hide_viewport = True


def _hidden_in_render(item: bpy.types.Object) -> None:
    item.hide_render = True


def _in_second_layer(item: bpy.types.Object) -> None:
    """The layer of which a render is asked for is the one that the window shows."""
    bpy.context.scene.view_layers.new("other")
    bpy.context.scene.view_layers[0].use = False


BASE, RELIEF = ("Principled BSDF", "Base Color"), ("Material Output", "Displacement")

#: A node, one of its outputs, and where that leads.
MATERIALS = {
    "object": ("ShaderNodeTexCoord", "Object", BASE),
    "position": ("ShaderNodeNewGeometry", "Position", BASE),
    "random": ("ShaderNodeObjectInfo", "Random", BASE),
    "generated": ("ShaderNodeTexCoord", "Generated", BASE),
    "checker": ("ShaderNodeTexChecker", "Color", BASE),
    "relief": ("ShaderNodeDisplacement", "Displacement", RELIEF),
    "bump": ("ShaderNodeDisplacement", "Displacement", RELIEF),
    "fog": ("ShaderNodeVolumeScatter", "Volume", ("Material Output", "Volume")),
}

#: Of Cycles, none as ours.
SETTINGS = {
    "film_exposure": 2.0,
    "diffuse_bounces": 3,
    "sample_clamp_direct": 7.0,
    "sample_clamp_indirect": 0.0,
    "use_fast_gi": True,
    "caustics_reflective": False,
}

FILES = {
    "subdivided": _subdivided,
    "row in renders": _repeated(in_viewport=False),
    "row in the viewport": _repeated(in_viewport=True),
    "instancer": _instanced,
    "scattered": _scattered,
    "collection": _collected,
    "ball": _ball,
    "hidden in the viewport": _hidden_in_viewport,
    "hidden in renders": _hidden_in_render,
    "second layer": _in_second_layer,
}

SIZES = (
    (1e-42, 0.0, "tiny"),
    (1e-6, 0.0, "little"),
    (1e-3, 0.0, "small"),
    (1e11, 0.0, "huge"),
    (1e9, 0.0, "large"),
    (1.0, 3e10, "far"),
)


if __name__ == "__main__":
    measured = (rendered_alone, linked, hidden_cameras, extents, treated, mirrored, keyed, distorted, compared, told)
    measurements = {one.__name__: one for one in measured}
    for name in sys.argv[2:]:
        measurements[name](Path(sys.argv[1]))
