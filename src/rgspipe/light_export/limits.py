"""Numbers of lights that other programs can read: single precision, of which they take squares."""

from __future__ import annotations

import math

import torch

from rgspipe.datasets.limits import FARTHEST, STRONGEST
from rgspipe.errors import InputError
from rgspipe.light_export.parts import radius, surface
from rgspipe.light_export.world import World
from rgspipe.scene import Light, LightRig
from rgspipe.scene.lights.shape_coordinates import Length

#: Metres of a unit, as `export.metres` takes them: from a nanometre to further than the moon.
LEAST_METRES, MOST_METRES = 1e-9, 1e9

#: What is done about a light that cannot be written.
REMEDY = "Check the light, and how many metres a scene unit is."


def check_world(world: World) -> None:
    """Refuse a unit that nothing is measured in.

    Raises:
        InputError: it is of no length, or of one beyond those of a world, or scaled by nothing.
    """
    if not LEAST_METRES <= world.metres <= MOST_METRES:
        expected, found = f"{LEAST_METRES:g} to {MOST_METRES:g}", f"{world.metres:g}"
        raise InputError("metres", expected=expected, found=found, remedy="Say how long a scene unit is.")
    if not 0.0 < world.rescale < math.inf:
        remedy = "Pass that of the dataset, or 1."
        raise InputError("rescale", expected="above 0", found=f"{world.rescale:g}", remedy=remedy)


def check_range(rig: LightRig) -> None:
    """Refuse lights, in metres, that no format can hold.

    Raises:
        InputError: a place, a size, an intensity or a radiance is beyond its limit; a panel has no area.
    """
    for index, light in enumerate(rig):
        lengths = {"position": float(light.position.abs().max())}
        lengths |= {
            one.name: float(getattr(light, one.name)) for one in light.shape if isinstance(one.coordinate, Length)
        }
        for name, length in lengths.items():
            _check(f"lights[{index}].{name}", length, FARTHEST, "m")
        unit = "W/m²" if light.distant else "W/sr"
        _check(f"lights[{index}].intensity", float(light.intensity.max()), STRONGEST, unit)
        _check(f"lights[{index}], its radiance", _radiance(light), torch.finfo(torch.float32).max, "W/(m² sr)")


def _check(where: str, value: float, most: float, unit: str) -> None:
    if not value <= most:
        expected = f"at most {most:.3g} {unit}"
        raise InputError(where, expected=expected, found=f"{value:.3g} {unit}", remedy=REMEDY)


def _radiance(light: Light) -> float:
    """Of its surface [W/(m² sr)]; 0 for what has none."""
    shape = surface(light)
    # A sphere of no size is a point.
    if shape is None or radius(light) == 0.0:
        return 0.0
    return float(light.intensity.max()) / shape.area if shape.area > 0.0 else math.inf
