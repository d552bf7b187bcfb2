"""Lamps as they hang in rooms: of some size, and near a surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch

from rgspipe.datasets.photometric_file import read_photometry
from rgspipe.scene import Light, PointLight
from rgspipe.scene.lights import LedLight, PanelLight, ProfileLight, SphereLight, SunLight

if TYPE_CHECKING:
    from rgspipe.blender.geometry import Geometry

#: Half of all lamps hang from what is above them, the others from what is beside them along an axis.
UP, SIDES = (0.0, 0.0, 1.0), ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))

#: Scene units between a panel and what it lies on, if nothing is said.
FLUSH = 0.002


@dataclass(frozen=True)
class LampRange:
    """What lamps are drawn from, uniformly, in scene units.

    Attributes:
        radius: least and largest, of spheres.
        side: the same, of panels' sides.
        exponent: the same, of LEDs.
        luminaires: files of measured luminaires, which lights take in turn.
        mounted: least and largest distance from the surface that a lamp hangs on; None where lamps hang free. Panels
            always lie on a surface, FLUSH before it where this is None.
    """

    radius: tuple[float, float] = (0.02, 0.08)
    side: tuple[float, float] = (0.1, 0.3)
    mounted: tuple[float, float] | None = None
    exponent: tuple[float, float] = (1.0, 16.0)
    luminaires: tuple[str, ...] = ()

    def draw(self, rng: np.random.Generator, kind: str, index: int) -> Light:
        """The `index`-th lamp of 1 W/sr, wherever it is; a sun of 1 W/unit² in any direction."""
        if kind == "spheres":
            return SphereLight.shaped(float(rng.uniform(*self.radius)))
        if kind == "panels":
            width, height = rng.uniform(*self.side, 2).tolist()
            return PanelLight.shaped(width, height, float(rng.uniform(-0.5 * math.pi, 0.5 * math.pi)))
        if kind == "suns":
            towards = torch.from_numpy(rng.normal(size=3))
            return SunLight.shaped().at(torch.zeros(3).double(), towards / towards.norm())
        if kind == "leds":
            return LedLight.shaped(float(rng.uniform(*self.exponent)))
        if kind == "profiles":
            table = read_photometry(self.luminaires[index % len(self.luminaires)])
            return ProfileLight.shaped(float(rng.uniform(-math.pi, math.pi)), table)
        return PointLight.shaped()

    def hang(self, kind: str) -> bool:
        """Whether lamps of a kind hang on surfaces."""
        return kind == "panels" or self.mounted is not None

    def hung(self, lamp: Light, near: np.ndarray, geometry: Geometry, rng: np.random.Generator) -> Light | None:
        """The lamp on a surface that `near` (3,) looks at; None if it does not fit there."""
        towards = np.array(UP if rng.uniform() < 0.5 else SIDES[rng.integers(len(SIDES))])
        gap = float(rng.uniform(*(self.mounted or (FLUSH, FLUSH))))
        reach = gap + (lamp.radius if isinstance(lamp, SphereLight) else 0.0)
        distance, in_front = geometry.cast(near, towards)
        if not in_front or not reach < distance < math.inf:
            return None
        place = near + (distance - reach) * towards
        if geometry.clearance(place) < (1.0 - 1e-3) * reach:
            return None
        lamp = lamp.at(torch.from_numpy(place), torch.from_numpy(-towards))
        nodes = [one.position.numpy() for one in lamp.parts()]
        return None if any(geometry.blocked(place, node) for node in nodes) else lamp
