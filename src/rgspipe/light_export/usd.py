"""USD with UsdLux: metres, Z is up."""

from __future__ import annotations

import math

from rgspipe.light_export.cone import Cone
from rgspipe.light_export.parts import Numbered, is_cone, peak_and_colour, pose, radius, rectangle
from rgspipe.scene import Light

HEADER = """#usda 1.0
(
    defaultPrim = "Lights"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "Lights" (
    kind = "component"
)
{
"""


def usda(lights: Numbered) -> tuple[str, list[str]]:
    """The text of a file, and what it does not hold."""
    made = "\n".join(_light(number, light) for number, light in lights.items())
    return f"{HEADER}{made}}}\n", [note for n, light in lights.items() for note in _notes(n, light)]


def _light(number: int, light: Light) -> str:
    peak, colour = peak_and_colour(light)
    if light.distant:
        # Of an angle of 0 the intensity is the irradiance across the light.
        kind, radiance, own = "DistantLight", peak, {"float inputs:angle": 0.0, "bool inputs:normalize": 1}
    elif lengths := rectangle(light):
        width, height = lengths
        kind, radiance = "RectLight", peak / (width * height)
        own = {"float inputs:width": width, "float inputs:height": height}
    else:
        # With normalize, radiance is intensity over the area 4πr², and a sphere of radiance L sends πr²L: 4 times I.
        kind, radiance = "SphereLight", 4.0 * peak
        size = radius(light) or 0.0
        own = {"float inputs:radius": size, "bool inputs:normalize": 1}
        own |= {} if size > 0.0 else {"bool treatAsPoint": 1}
    schema, matrix = "", pose(light)
    if is_cone(light):
        cone = Cone.of(light)
        radiance, matrix = cone.peak * radiance, cone.pose(light)
        schema = ' (\n        prepend apiSchemas = ["ShapingAPI"]\n    )'
        own |= {"float inputs:shaping:cone:angle": math.degrees(cone.outer)}
        own |= {"float inputs:shaping:cone:softness": max(0.0, 1.0 - cone.inner / cone.outer)}
    own |= {"float inputs:intensity": radiance}
    lines = [f"        {name} = {value!r}" for name, value in own.items()]
    lines.append(f"        color3f inputs:color = ({', '.join(map(repr, colour))})")
    rows = ", ".join(f"({', '.join(map(repr, row))})" for row in matrix.T.tolist())
    lines.append(f"        matrix4d xformOp:transform = ( {rows} )")
    lines.append('        uniform token[] xformOpOrder = ["xformOp:transform"]')
    return f'    def {kind} "light_{number}"{schema}\n    {{\n' + "\n".join(lines) + "\n    }\n"


def _notes(number: int, light: Light) -> list[str]:
    if is_cone(light):
        said = "a cone of USD falls off as its renderer likes, the profile of a"
        return [f"light {number}: {said} {light.kind} is not held.", *Cone.of(light).notes(number)]
    return []
