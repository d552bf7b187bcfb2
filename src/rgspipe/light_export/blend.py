"""Blender: a script that adds the lamps to an open file, or writes a file of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import torch
from torch import Tensor

from rgspipe.light_export.parts import Numbered, is_spot, peak_and_colour, pose, radius, rectangle
from rgspipe.scene import Light
from rgspipe.scene.lights import WATTS_PER_INTENSITY

#: Standard deviations of the ellipsoid that holds 95 % of a normal distribution in space.
ELLIPSOID = 2.795

SCRIPT = '''"""Lamps found by rgspipe, in metres and watts.

Open your file and run this in Blender's Scripting workspace; or, without a window,
    blender YOUR.blend --background --python THIS.py -- OUT.blend
They render as they were found with Cycles if "Max Bounces" (Light Paths) are 64, "Total" and "Diffuse", and "Light
Threshold" (Sampling, Lights) and both values of "Clamping" are 0: Blender's defaults leave out late bounces, up to a
third of the light, and what is dim or bright. A wire ellipsoid around a lamp holds its place with 95 %.
"""

import sys

import bpy
from mathutils import Matrix


def lamp(name, kind, watts, colour, pose, **fields):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = watts, colour
    for field, value in fields.items():
        # Before Blender 4 there is no soft falloff to be switched off.
        if field != "use_soft_falloff" or field in data.bl_rna.properties:
            setattr(data, field, value)
    item = bpy.data.objects.new(name, data)
    item.matrix_world = Matrix(pose)
    bpy.context.scene.collection.objects.link(item)
    return item


def region(name, pose):
    item = bpy.data.objects.new(name, None)
    item.empty_display_type, item.matrix_world = "SPHERE", Matrix(pose)
    bpy.context.scene.collection.objects.link(item)


def tree_of(item):
    item.data.use_nodes = True
    tree = item.data.node_tree
    tree.nodes.clear()
    return tree


def put(tree, socket, value):
    if isinstance(value, bpy.types.NodeSocket):
        tree.links.new(value, socket)
    else:
        socket.default_value = value


def math(tree, operation, *values):
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for socket, value in zip(node.inputs, values):
        put(tree, socket, value)
    return node.outputs["Value"]


def ramp(tree, kind, value, zero, one):
    node = tree.nodes.new("ShaderNodeMapRange")
    node.interpolation_type, node.clamp = kind, True
    for name, given in (("Value", value), ("From Min", zero), ("From Max", one)):
        put(tree, node.inputs[name], given)
    return node.outputs["Result"]


def cosine(tree, axis):
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "DOT_PRODUCT"
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"], node.inputs[0])
    node.inputs[1].default_value = axis
    return node.outputs["Value"]


def shine(tree, strength):
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputLight")
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    put(tree, emission.inputs["Strength"], strength)


'''

SAVE = """
if "--" in sys.argv:
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
"""


def blend(lights: Numbered, covariances: Sequence[Tensor | None] = ()) -> tuple[str, list[str]]:
    """The text of the script, which holds every one exactly.

    Args:
        covariances: (3, 3) of each light's place [m²], where it is known.

    Returns:
        the text, and of which lights no ellipsoid shows how sure their place is.
    """
    lines, notes = [], []
    for number, light in lights.items():
        lines += _lamp(f"light {number}", light)
    for number, covariance in enumerate(covariances, start=1):
        if number not in lights or covariance is None:
            continue
        if bool(torch.isfinite(covariance).all()):
            lines.append(f'region("light {number} (95 %)", {_ellipsoid(lights[number].position, covariance)})')
        else:
            notes.append(f"light {number}: the images do not tell where it is along every axis; it has no ellipsoid.")
    return SCRIPT + "\n".join(lines) + "\n" + SAVE, notes


def _lamp(name: str, light: Light) -> list[str]:
    peak, colour = peak_and_colour(light)
    fields = {"use_soft_falloff": False, "shadow_soft_size": 0.0}
    kind, watts = "POINT", WATTS_PER_INTENSITY * peak
    if light.distant:
        # Blender's strength of a sun is W/m² across its light.
        kind, watts, fields = "SUN", peak, {"angle": 0.0}
    elif lengths := rectangle(light):
        width, height = lengths
        kind, watts = "AREA", math.pi * peak
        fields = {"shape": "RECTANGLE", "size": width, "size_y": height}
    elif size := radius(light):
        fields["shadow_soft_size"] = size
    elif is_spot(light, "smoothstep") and light.cone_angle <= 0.5 * math.pi:
        kind = "SPOT"
        fields |= {"spot_size": 2.0 * float(light.cone_angle), "spot_blend": float(light.falloff)}
    given = "".join(f", {field}={value!r}" for field, value in fields.items())
    made = f"lamp({name!r}, {kind!r}, {watts!r}, {tuple(colour)!r}, {pose(light).tolist()!r}{given})"
    if kind != "POINT" or light.axis is None:
        return [made]
    maths = _Source()
    strength = light.emission(maths, f"cosine(tree, {tuple(light.axis.tolist())!r})")
    return [f"tree = tree_of({made})", *maths.lines, f"shine(tree, {strength})"]


def _ellipsoid(position: Tensor, covariance: Tensor) -> list[list[float]]:
    variances, axes = torch.linalg.eigh(covariance.double())
    matrix = torch.eye(4, dtype=torch.float64)
    matrix[:3, :3] = axes * (ELLIPSOID * variances.clamp(min=0.0).sqrt())
    matrix[:3, 3] = position.double()
    return matrix.tolist()


class _Source:
    """What `Light.emission` makes expressions with, as lines of the script."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def __getattr__(self, operation: str) -> Callable[..., str]:
        """Blender's scalar operations."""
        return partial(self._call, "math", operation.upper())

    def exponential(self, value: object) -> str:
        return self._call("math", "EXPONENT", value)

    def arccosine(self, value: object) -> str:
        """Of a cosine that rounding may have brought out of [−1, 1]."""
        return self._call("math", "ARCCOSINE", self.minimum(self.maximum(value, -1.0), 1.0))

    def linear(self, value: object, zero: float, one: float) -> str:
        return self._call("ramp", "LINEAR", value, zero, one)

    def smoothstep(self, value: object, zero: float, one: float) -> str:
        return self._call("ramp", "SMOOTHSTEP", value, zero, one)

    def _call(self, function: str, operation: str, *values: object) -> str:
        name = f"n{len(self.lines)}"
        shown = ", ".join(value if isinstance(value, str) else repr(float(value)) for value in values)
        self.lines.append(f"{name} = {function}(tree, {operation!r}, {shown})")
        return name
