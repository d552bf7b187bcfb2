"""Materials whose reflectance is known exactly: diffuse, of one colour or patterned, and with a Phong lobe."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path

import bpy
from cycles.osl import osl_compile

from rgspipe.blender.nodes import tree_of
from rgspipe.scene.models import Vector

#: The Phong lobe of `scene/gloss.py`. Of Cycles' own nodes none is it: all follow the half vector.
PHONG_SHADER = """
shader phong(color Reflectance = 0, float Exponent = 1, output closure color BSDF = 0)
{
    color white[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    BSDF = Reflectance * phong_ramp(N, Exponent, white);
}
"""


def diffuse_material(name: str, albedo: Vector) -> bpy.types.Material:
    """A purely diffuse (Lambertian) material."""
    material, tree = _empty(name)
    _finish(tree, _diffuse(tree, albedo).outputs["BSDF"])
    return material


def glossy_material(name: str, albedo: Vector, reflectance: float, exponent: float) -> bpy.types.Material:
    """Diffuse, plus a Phong lobe of specular reflectance k_s and exponent n: the model of `scene/gloss.py`, exactly.

    The open scene is switched to Open Shading Language, in which the lobe is written.
    """
    material, tree = _empty(name)
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.shading_system = True
    lobe = tree.nodes.new("ShaderNodeScript")
    lobe.mode = "INTERNAL"
    lobe.bytecode = _compiled(PHONG_SHADER)
    lobe.bytecode_hash = hashlib.md5(lobe.bytecode.encode(), usedforsecurity=False).hexdigest()
    lobe.inputs.new("NodeSocketColor", "Reflectance").default_value = (reflectance, reflectance, reflectance, 1.0)
    lobe.inputs.new("NodeSocketFloat", "Exponent").default_value = exponent
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(_diffuse(tree, albedo).outputs["BSDF"], both.inputs[0])
    tree.links.new(lobe.outputs.new("NodeSocketShader", "BSDF"), both.inputs[1])
    _finish(tree, both.outputs["Shader"])
    return material


def checker_material(name: str, first: Vector, second: Vector, size: float) -> bpy.types.Material:
    """Diffuse cubes of edge length `size`, in two colours by turns; in the object's own coordinates."""
    material, tree = _empty(name)
    checker = tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value = (*first, 1.0)
    checker.inputs["Color2"].default_value = (*second, 1.0)
    checker.inputs["Scale"].default_value = 1.0 / size
    tree.links.new(_place(tree), checker.inputs["Vector"])
    _finish(tree, _diffuse(tree, checker.outputs["Color"]).outputs["BSDF"])
    return material


def striped_material(
    name: str, first: Vector, second: Vector, period: float, turn: Vector = (0.0, 0.0, 0.0), distortion: float = 0.0
) -> bpy.types.Material:
    """Diffuse, fading from one colour to the other and back along the object's x axis, turned by `turn` [rad].

    Args:
        period: from one stripe to the next, scene units.
        distortion: how much noise bends the stripes; 0 for straight ones.
    """
    material, tree = _empty(name)
    wave = tree.nodes.new("ShaderNodeTexWave")
    # Blender's wave repeats every 2π/20 units at scale 1.
    wave.inputs["Scale"].default_value = 0.314159265 / period
    wave.inputs["Distortion"].default_value = distortion
    tree.links.new(_place(tree, turn), wave.inputs["Vector"])
    colour = _blend(tree, wave.outputs["Factor"], first, second, 0.25, 0.75)
    _finish(tree, _diffuse(tree, colour).outputs["BSDF"])
    return material


def mottled_material(name: str, first: Vector, second: Vector, size: float) -> bpy.types.Material:
    """Diffuse noise between two colours, with blots of about `size`; in the object's own coordinates."""
    material, tree = _empty(name)
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 1.0 / size
    noise.inputs["Detail"].default_value = 1.0
    tree.links.new(_place(tree), noise.inputs["Vector"])
    colour = _blend(tree, noise.outputs["Factor"], first, second, 0.35, 0.65)
    _finish(tree, _diffuse(tree, colour).outputs["BSDF"])
    return material


def brick_material(
    name: str, first: Vector, second: Vector, joint: Vector, size: tuple[float, float]
) -> bpy.types.Material:
    """Diffuse boards or tiles on the object's x–y plane, each of a colour between two, with joints.

    Args:
        size: length along x and width along y of a board, scene units.
    """
    material, tree = _empty(name)
    brick = tree.nodes.new("ShaderNodeTexBrick")
    for key, colour in (("Color1", first), ("Color2", second), ("Mortar", joint)):
        brick.inputs[key].default_value = (*colour, 1.0)
    sizes = {"Scale": 1.0, "Brick Width": size[0], "Row Height": size[1], "Mortar Size": 0.03 * size[1]}
    for key, value in sizes.items():
        brick.inputs[key].default_value = value
    tree.links.new(_place(tree), brick.inputs["Vector"])
    _finish(tree, _diffuse(tree, brick.outputs["Color"]).outputs["BSDF"])
    return material


def _empty(name: str) -> tuple[bpy.types.Material, bpy.types.NodeTree]:
    material = bpy.data.materials.new(name)
    tree = tree_of(material)
    tree.nodes.clear()
    return material, tree


def _diffuse(tree: bpy.types.NodeTree, colour: Vector | bpy.types.NodeSocket) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    if isinstance(colour, bpy.types.NodeSocket):
        tree.links.new(colour, node.inputs["Color"])
    else:
        node.inputs["Color"].default_value = (*colour, 1.0)
    return node


def _finish(tree: bpy.types.NodeTree, surface: bpy.types.NodeSocket) -> None:
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(surface, output.inputs["Surface"])


def _place(tree: bpy.types.NodeTree, turn: Vector = (0.0, 0.0, 0.0)) -> bpy.types.NodeSocket:
    """The object's own coordinates, turned."""
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = turn
    tree.links.new(coordinates.outputs["Object"], mapping.inputs["Vector"])
    return mapping.outputs["Vector"]


def _blend(
    tree: bpy.types.NodeTree, factor: bpy.types.NodeSocket, first: Vector, second: Vector, low: float, high: float
) -> bpy.types.NodeSocket:
    """The first colour where the factor is below `low`, the second above `high`, mixed in between."""
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    for element, position, colour in zip(ramp.color_ramp.elements, (low, high), (first, second), strict=True):
        element.position, element.color = position, (*colour, 1.0)
    tree.links.new(factor, ramp.inputs["Factor"])
    return ramp.outputs["Color"]


def _compiled(source: str) -> str:
    """The bytecode of a shader."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shader.osl"
        path.write_text(source, encoding="utf-8")
        messages: list[str] = []
        done, compiled = osl_compile(str(path), lambda kind, text: messages.append(f"{kind}: {text}"))
        if not done:
            raise RuntimeError(f"Blender cannot compile a shader. {' '.join(messages)}")
        bytecode = Path(compiled).read_text(encoding="utf-8")
        Path(compiled).unlink()
    return bytecode
