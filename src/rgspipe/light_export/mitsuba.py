"""Mitsuba 3: emitters to be put into a scene's XML."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rgspipe.light_export.cone import Cone
from rgspipe.light_export.parts import Numbered, is_cone, is_spot, pose, radius, rectangle
from rgspipe.scene import Light


def mitsuba(lights: Numbered) -> tuple[str, list[str]]:
    """The text of a file, and what it does not hold."""
    notes = [note for number, light in lights.items() for note in _notes(number, light)]
    return "\n".join(['<scene version="3.0.0">', *map(_emitter, lights.values()), "</scene>", ""]), notes


def _emitter(light: Light) -> str:
    if light.distant:
        x, y, z = light.axis.tolist()
        along = f'<vector name="direction" x="{x!r}" y="{y!r}" z="{z!r}"/>'
        return f'  <emitter type="directional">{along}{_rgb("irradiance", light)}</emitter>'
    x, y, z = light.position.tolist()
    if size := radius(light):
        radiance = _rgb("radiance", light, 1.0 / (math.pi * size**2))
        place = f'<point name="center" x="{x!r}" y="{y!r}" z="{z!r}"/><float name="radius" value="{size!r}"/>'
        return f'  <shape type="sphere">{place}<emitter type="area">{radiance}</emitter></shape>'
    if lengths := rectangle(light):
        width, height = lengths
        radiance = _rgb("radiance", light, 1.0 / (width * height))
        # Mitsuba's rectangle spans −1 to 1 and shines along +z; z of our frame is against the axis.
        scaled = pose(light)
        scaled[:3, 0] *= 0.5 * width
        scaled[:3, 1] *= -0.5 * height
        scaled[:3, 2] *= -1.0
        return f'  <shape type="rectangle">{_matrix(scaled)}<emitter type="area">{radiance}</emitter></shape>'
    if is_cone(light):
        cone = Cone.of(light)
        inner, outer = math.degrees(cone.inner), math.degrees(cone.outer)
        angles = f'<float name="beam_width" value="{inner!r}"/><float name="cutoff_angle" value="{outer!r}"/>'
        # Mitsuba's spot looks along +z.
        turned = cone.pose(light)
        turned[:3, 1:3] *= -1.0
        return f'  <emitter type="spot">{_matrix(turned)}{angles}{_rgb("intensity", light, cone.peak)}</emitter>'
    place = f'<point name="position" x="{x!r}" y="{y!r}" z="{z!r}"/>'
    return f'  <emitter type="point">{place}{_rgb("intensity", light)}</emitter>'


def _notes(number: int, light: Light) -> list[str]:
    if is_cone(light) and not is_spot(light, "linear"):
        said = f"light {number}: a spot of Mitsuba falls linearly with the angle, a {light.kind} does not."
        return [said, *Cone.of(light).notes(number)]
    return []


def _rgb(name: str, light: Light, factor: float = 1.0) -> str:
    return f'<rgb name="{name}" value="{", ".join(repr(factor * value) for value in light.intensity.tolist())}"/>'


def _matrix(matrix: Sequence[Sequence[float]]) -> str:
    values = " ".join(repr(float(value)) for row in matrix for value in row)
    return f'<transform name="to_world"><matrix value="{values}"/></transform>'
