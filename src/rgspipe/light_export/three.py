"""three.js: an object for its ObjectLoader; metres, candela, Z is up as in the scene."""

from __future__ import annotations

import json
import uuid

from torch import Tensor

from rgspipe.light_export.cone import Cone
from rgspipe.light_export.parts import Numbered, is_cone, is_spot, peak_and_colour, pose, radius, rectangle
from rgspipe.light_export.world import LUMENS_PER_WATT
from rgspipe.scene import Light, srgb


def three(lights: Numbered) -> tuple[str, list[str]]:
    """The text of a file, and what it does not hold."""
    children = [child for number, light in lights.items() for child in _objects(number, light)]
    content = {
        "metadata": {"version": 4.6, "type": "Object", "generator": "rgspipe"},
        "object": {"uuid": _id("lights"), "type": "Group", "name": "lights, z up", "children": children},
    }
    notes = ["three.js colours have 8 bits a channel."] if lights else []
    notes += [note for number, light in lights.items() for note in _notes(number, light)]
    return json.dumps(content, indent=1) + "\n", notes


def _objects(number: int, light: Light) -> list[dict]:
    name = f"light {number}"
    peak, colour = peak_and_colour(light)
    red, green, blue = (round(255.0 * float(srgb.encode(value))) for value in colour)
    fields = {
        "uuid": _id(name),
        "name": name,
        "color": red << 16 | green << 8 | blue,
        "matrix": pose(light).T.reshape(-1).tolist(),
    }
    if lengths := rectangle(light):
        # nits: candela along the axis over the area.
        width, height = lengths
        shown = {"type": "RectAreaLight", "width": width, "height": height}
        return [fields | shown | {"intensity": LUMENS_PER_WATT * peak / (width * height)}]
    fields |= {"intensity": LUMENS_PER_WATT * peak}
    fading = {"distance": 0, "decay": 2}
    if light.axis is None:
        return [fields | fading | {"type": "PointLight"}]
    if light.distant:
        target = _target(name, pose(light))
        return [fields | {"type": "DirectionalLight", "target": target["uuid"]}, target]
    cone = Cone.of(light).narrow(light)
    matrix = cone.pose(light)
    target = _target(name, matrix)
    shown = {"type": "SpotLight", "angle": cone.outer, "penumbra": 1.0 - cone.inner / cone.outer}
    fields |= {"matrix": matrix.T.reshape(-1).tolist(), "intensity": cone.peak * fields["intensity"]}
    return [fields | fading | shown | {"target": target["uuid"]}, target]


def _target(name: str, pose: Tensor) -> dict:
    """What an aimed light, whose pose (4, 4) is given, looks at."""
    aim = pose.clone()
    aim[:3, 3] -= pose[:3, 2]
    known = {"uuid": _id(f"{name} target"), "type": "Object3D", "name": f"{name} target"}
    return known | {"matrix": aim.T.reshape(-1).tolist()}


def _notes(number: int, light: Light) -> list[str]:
    if (size := radius(light)) is not None:
        return [f"light {number}: three.js has no spheres; that of radius {size:.4g} m is a point."]
    if not is_cone(light):
        return []
    said = f"light {number}: a spot of three.js falls with a smoothstep of the cosine, a {light.kind} does not."
    return [*([] if is_spot(light, "smoothstep") else [said]), *Cone.of(light).narrow(light).notes(number)]


def _id(name: str) -> str:
    """The same for the same name, so that the same lights give the same file."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"rgspipe:{name}"))
