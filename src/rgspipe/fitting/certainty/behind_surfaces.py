"""Lights of which next to nothing reaches the scene.

A light below a floor, behind a wall or inside of a thing can explain an image by what errors of the geometry let
through, if only it is strong enough: surfels end a little short of an edge, or are turned by a degree.
"""

from __future__ import annotations

import torch

from rgspipe.fitting.findings import BehindSurfaces
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.reach import LEAST_FLUX
from rgspipe.scene import LightRig


def behind_surfaces(rig: LightRig, frozen: FrozenScene, shadows: bool = True) -> list[BehindSurfaces]:
    """The lights of a rig that stand where next to no light reaches the scene; none if there are no `shadows`.

    A light that lies in a surface, or is infinitely far away, has no such place.
    """
    free = [(number, light) for number, light in enumerate(rig, start=1) if not (light.flush or light.distant)]
    if not (shadows and free and len(frozen.dictionary)):
        return []
    positions = torch.stack([light.position.double().cpu() for _, light in free])
    flux = frozen.unit_irradiance(positions)[0] @ frozen.areas
    shares = frozen.dictionary.reach(frozen.areas, frozen.surroundings).shares(positions, flux).tolist()
    pairs = zip(free, shares, strict=True)
    return [BehindSurfaces(number, len(rig), share) for (number, _), share in pairs if share < LEAST_FLUX]
