"""glTF 2.0 with KHR_lights_punctual: Y is up, metres, candela."""

from __future__ import annotations

import json

import torch

from rgspipe.light_export.cone import Cone
from rgspipe.light_export.parts import Numbered, is_cone, peak_and_colour, pose, radius, rectangle
from rgspipe.light_export.world import LUMENS_PER_WATT
from rgspipe.scene import Light

#: From axes with Z up to those with Y up.
Y_UP = torch.tensor([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=torch.float64)

CONVENTION = (
    f"intensity [cd] = {LUMENS_PER_WATT:g} lm/W x radiant intensity [W/sr] of the brightest channel; "
    "of directional lights [lx] and irradiance [W/m2]"
)


def gltf(lights: Numbered) -> tuple[str, list[str]]:
    """The text of a file, and what it does not hold."""
    held = [(number, light) for number, light in lights.items() if not rectangle(light)]
    content = {
        "asset": {"version": "2.0", "generator": "rgspipe", "extras": {"photometry": CONVENTION}},
        "scene": 0,
        "scenes": [{"nodes": [*range(len(held))]} if held else {}],
    }
    if held:
        punctual = {"KHR_lights_punctual": {"lights": [_light(number, light) for number, light in held]}}
        content |= {"extensionsUsed": [*punctual], "extensions": punctual}
        content["nodes"] = [_node(index, number, light) for index, (number, light) in enumerate(held)]
    return json.dumps(content, indent=1) + "\n", [note for n, light in lights.items() for note in _notes(n, light)]


def _light(number: int, light: Light) -> dict:
    peak, colour = peak_and_colour(light)
    fields = {"name": f"light {number}", "color": colour, "intensity": LUMENS_PER_WATT * peak}
    if not is_cone(light):
        return fields | {"type": "directional" if light.distant else "point"}
    cone = Cone.of(light).narrow(light)
    angles = {"innerConeAngle": min(cone.inner, 0.999 * cone.outer), "outerConeAngle": cone.outer}
    return fields | {"intensity": cone.peak * fields["intensity"], "type": "spot", "spot": angles}


def _node(index: int, number: int, light: Light) -> dict:
    own = Cone.of(light).pose(light) if is_cone(light) else pose(light)
    matrix = (Y_UP @ own @ _turned_back(light)).T.reshape(-1).tolist()
    return {"name": f"light {number}", "matrix": matrix, "extensions": {"KHR_lights_punctual": {"light": index}}}


def _turned_back(light: Light) -> torch.Tensor:
    """Without an axis nothing is turned: the node keeps the axes of glTF."""
    return torch.eye(4, dtype=torch.float64) if light.axis is not None else Y_UP.T


def _notes(number: int, light: Light) -> list[str]:
    if rectangle(light):
        return [f"light {number}: glTF has no area lights; the {light.kind} is left out."]
    if (size := radius(light)) is not None:
        return [f"light {number}: glTF has no lights of a size; the {light.kind} of radius {size:.4g} m is a point."]
    if is_cone(light):
        said = f"light {number}: a spot of glTF falls with a squared ramp of the cosine, a {light.kind} does not."
        return [said, *Cone.of(light).narrow(light).notes(number)]
    return []
