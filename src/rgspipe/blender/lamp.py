"""A lamp that shines as any of our lights.

Light is emitted by a point lamp, of radius 0 unless the light is a sphere, whose shader multiplies it with the light's
profile of the angle between its axis and the direction in which the light leaves: one way for all profiles, also for
those that Blender's own spots do not have. A measured luminaire is a file of LM-63 to Cycles, which interpolates it in
its own way. A panel is Blender's own rectangle, a sun its own sun.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import bpy
import torch
from mathutils import Matrix

from rgspipe.errors import InputError
from rgspipe.light_export.ies import ies
from rgspipe.light_export.parts import frame, is_of_another_shape, peak_and_colour, radius, rectangle
from rgspipe.light_export.world import candela
from rgspipe.scene import Light
from rgspipe.scene.lights import WATTS_PER_INTENSITY, ProfileLight
from rgspipe.scene.lights.coordinates import tangents

#: What Cycles makes of a candela in a file of LM-63: 4π over the 177.83 lm/W of daylight.
CYCLES_CANDELA = 0.0706650768394

#: The text of a measured luminaire, for Cycles.
TABLE = "luminaire"

Value = bpy.types.NodeSocket | float


def place_lamp(item: bpy.types.Object, light: Light) -> None:
    """Give `item` a lamp with the extent, the profile, the axis, the place and the intensity of `light`."""
    before, item.data = item.data, _lamp(light)
    if before is not None:
        bpy.data.lights.remove(before)
    peak, item.data.color = peak_and_colour(light)
    item.data.energy = _energy(light) * peak
    item.matrix_world = _pose(light)


def _lamp(light: Light) -> bpy.types.Light:
    if light.distant:
        lamp = bpy.data.lights.new("light", "SUN")
        lamp.angle = 0.0
        return lamp
    if is_of_another_shape(light):
        raise InputError(
            f"a {light.label}",
            expected="a lamp in one point, a sphere, a rectangle or a sun, as Blender has them",
            found="an extent of another shape",
            remedy="Choose such a light, or several.",
        )
    sides = rectangle(light)
    return _bulb(light) if sides is None else _panel(*sides)


def _energy(light: Light) -> float:
    """Blender's strength of a light of intensity 1: W, and of a sun W/m² across its light."""
    if light.distant:
        return 1.0
    return WATTS_PER_INTENSITY if rectangle(light) is None else math.pi


def _bulb(light: Light) -> bpy.types.Light:
    lamp = bpy.data.lights.new("light", "POINT")
    if "use_soft_falloff" in lamp.bl_rna.properties:  # Blender 4 and later
        lamp.use_soft_falloff = False
    lamp.shadow_soft_size = radius(light) or 0.0
    lamp.use_nodes = True
    nodes = _Nodes(lamp.node_tree)
    emission, output = nodes.add("ShaderNodeEmission"), nodes.add("ShaderNodeOutputLight")
    nodes.tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    if light.axis is not None:
        measured = isinstance(light, ProfileLight)
        relative = (
            _table(nodes, light) if measured else light.emission(_Maths(nodes), nodes.cosine(light.axis.tolist()))
        )
        nodes.tree.links.new(relative, emission.inputs["Strength"])
    return lamp


def _table(nodes: _Nodes, light: ProfileLight) -> bpy.types.NodeSocket:
    """Relative intensity of a measured luminaire, as Cycles reads its table."""
    before = bpy.data.texts.get((TABLE, None))  # of no library
    if before is not None:
        bpy.data.texts.remove(before)
    unit, node = replace(light, intensity=torch.ones(3).double()), nodes.add("ShaderNodeTexIES")
    node.mode, node.ies = "INTERNAL", bpy.data.texts.new(TABLE)
    node.ies.write(ies(unit, TABLE)[0])
    node.inputs["Strength"].default_value = 1.0 / (CYCLES_CANDELA * candela(unit))
    # Cycles counts angles from −z, and around it from −y towards −x: clockwise as seen from above, unlike such files.
    across, up, axis = light.frame()
    across, axis = -across, -axis
    vector = nodes.add("ShaderNodeCombineXYZ")
    for name, part in (("X", up), ("Y", across), ("Z", axis)):
        nodes.tree.links.new(nodes.cosine(part.tolist()), vector.inputs[name])
    nodes.tree.links.new(vector.outputs["Vector"], node.inputs["Vector"])
    return node.outputs["Fac"]


def _panel(width: float, height: float) -> bpy.types.Light:
    lamp = bpy.data.lights.new("light", "AREA")
    lamp.shape, lamp.size, lamp.size_y = "RECTANGLE", width, height
    return lamp


def _pose(light: Light) -> Matrix:
    """Blender's lamps shine along −z; a panel's width is along x."""
    pose = torch.eye(4, dtype=torch.float64)
    if rectangle(light) is not None:
        pose[:3, :3] = frame(light)
    elif light.distant:
        pose[:3, :3] = torch.cat([tangents(light.axis), -light.axis[None]]).T * torch.tensor([1.0, -1.0, 1.0])
    pose[:3, 3] = light.position
    return Matrix(pose.tolist())


class _Nodes:
    """An empty node tree of a lamp, and what is put into it."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self.tree = tree
        tree.nodes.clear()

    def add(self, kind: str) -> bpy.types.Node:
        return self.tree.nodes.new(kind)

    def math(self, operation: str, *values: bpy.types.NodeSocket | float) -> bpy.types.NodeSocket:
        """The result of a scalar operation on numbers or outputs of other nodes."""
        node = self.add("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, values, strict=False):
            self._set(socket, value)
        return node.outputs["Value"]

    def ramp(self, kind: str, value: bpy.types.NodeSocket, zero: float, one: float) -> bpy.types.NodeSocket:
        """0 at `zero`, 1 at `one`, in between as `kind` says: LINEAR or SMOOTHSTEP; clamped."""
        node = self.add("ShaderNodeMapRange")
        node.interpolation_type, node.clamp = kind, True
        self._set(node.inputs["Value"], value)
        self._set(node.inputs["From Min"], zero)
        self._set(node.inputs["From Max"], one)
        return node.outputs["Result"]

    def cosine(self, axis: list[float]) -> bpy.types.NodeSocket:
        """Cosine of the angle between `axis` and the way of the light."""
        node = self.add("ShaderNodeVectorMath")
        node.operation = "DOT_PRODUCT"
        # In a lamp's shader, "Incoming" points from the lamp to what it lights.
        self._set(node.inputs[0], self.add("ShaderNodeNewGeometry").outputs["Incoming"])
        node.inputs[1].default_value = axis
        return node.outputs["Value"]

    def _set(self, socket: bpy.types.NodeSocket, value: bpy.types.NodeSocket | float) -> None:
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value


class _Maths:
    """The expressions that profiles are made of, as nodes."""

    def __init__(self, nodes: _Nodes) -> None:
        self._nodes = nodes

    def __getattr__(self, operation: str) -> Callable[..., bpy.types.NodeSocket]:
        """Blender's own scalar operations: add, subtract, multiply, divide, power, minimum, maximum, greater_than …"""
        return partial(self._nodes.math, operation.upper())

    def exponential(self, value: Value) -> bpy.types.NodeSocket:
        return self._nodes.math("EXPONENT", value)

    def arccosine(self, value: Value) -> bpy.types.NodeSocket:
        """Of a cosine that rounding may have brought out of [−1, 1]."""
        return self._nodes.math("ARCCOSINE", self.minimum(self.maximum(value, -1.0), 1.0))

    def linear(self, value: Value, zero: float, one: float) -> bpy.types.NodeSocket:
        """0 at `zero`, 1 at `one`, linear in between."""
        return self._nodes.ramp("LINEAR", value, zero, one)

    def smoothstep(self, value: Value, zero: float, one: float) -> bpy.types.NodeSocket:
        """0 at `zero`, 1 at `one`, smooth in between."""
        return self._nodes.ramp("SMOOTHSTEP", value, zero, one)
