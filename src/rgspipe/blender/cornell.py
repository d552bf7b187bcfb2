"""The parametric Cornell box, modelled in bpy."""

from __future__ import annotations

import bpy

from rgspipe.blender.job import Box, CornellParameters, Vector


def build(parameters: CornellParameters) -> bpy.types.Scene:
    """A new scene that holds the room and its boxes, and nothing else: no light, camera or world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    for name, corners, albedo in _walls(parameters):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        _add(scene, name, mesh, diffuse_material(name, albedo))
    for index, box in enumerate(parameters.boxes):
        _add_box(scene, f"box_{index}", box)
    bpy.context.view_layer.update()
    return scene


def diffuse_material(name: str, albedo: Vector) -> bpy.types.Material:
    """A purely diffuse (Lambertian) material."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*albedo, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    return material


def _walls(parameters: CornellParameters) -> list[tuple[str, list[Vector], Vector]]:
    """Name, corners and albedo of the five walls; all face into the room."""
    a, b, c = (0.5 * length for length in parameters.room)
    floor = [(-a, -b, -c), (a, -b, -c), (a, b, -c), (-a, b, -c)]
    ceiling = [(-a, -b, c), (-a, b, c), (a, b, c), (a, -b, c)]
    back = [(-a, b, -c), (a, b, -c), (a, b, c), (-a, b, c)]
    left = [(-a, -b, -c), (-a, b, -c), (-a, b, c), (-a, -b, c)]
    right = [(a, -b, -c), (a, -b, c), (a, b, c), (a, b, -c)]
    white = [("floor", floor), ("ceiling", ceiling), ("back", back)]
    walls = [(name, corners, parameters.white) for name, corners in white]
    return [*walls, ("left", left, parameters.left), ("right", right, parameters.right)]


def _add_box(scene: bpy.types.Scene, name: str, box: Box) -> None:
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(c * s for c, s in zip(corner, box.size, strict=True)) for corner in corners], [], faces)
    item = _add(scene, name, mesh, diffuse_material(name, box.albedo))
    item.location = box.center
    item.rotation_euler = (0.0, 0.0, box.turn)


def _add(scene: bpy.types.Scene, name: str, mesh: bpy.types.Mesh, material: bpy.types.Material) -> bpy.types.Object:
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(item)
    return item
