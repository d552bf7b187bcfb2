"""Suns: light from so far away that it arrives from one direction everywhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import torch
from torch import Tensor

from rgspipe.scene.lights.coordinates import AXIS, KNOWN, Coordinate
from rgspipe.scene.lights.light import Light
from rgspipe.scene.lights.nodes import Nodes
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.shapes import Float, Given


@dataclass(frozen=True)
class SunLight(Light):
    """Parallel light: a surface across it gets the irradiance I, wherever it is.

    Its `intensity` is that irradiance in W per square of a scene unit, and its `position` is only where it is drawn.

    Attributes:
        direction: (3,) unit vector along which it shines, away from the sun.
    """

    kind: ClassVar[str] = "sun"
    distant: ClassVar[bool] = True
    unit: ClassVar[str] = "W/unit²"

    direction: Given

    @classmethod
    def shaped(cls) -> Self:
        """A sun of 1 W/unit² that shines along −z."""
        return cls([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0])

    @property
    def axis(self) -> Float[Tensor, " 3"]:
        return self.direction

    def standing(self, size: float) -> Float[Tensor, " 3"]:
        """As far away as the scene is large, so that distances over the size are angles [rad]."""
        return -size * torch.nn.functional.normalize(self.direction, dim=0)

    def standing_spread(self, covariance: Any, size: float) -> Any:
        """Directions lie on a sphere, so one that is off by an angle e stands e²/2 short of the plane that touches."""
        spread = torch.as_tensor(covariance, dtype=torch.float64)[3:6, 3:6]
        if not bool(torch.isfinite(spread).all()):
            return size**2 * spread
        # The mean of (e²/2)² where both parts of e are normal.
        short = 0.25 * (spread.trace().square() + 2.0 * (spread @ spread).trace())
        axis = torch.nn.functional.normalize(self.direction.to(spread), dim=0)
        return size**2 * (spread + short * torch.outer(axis, axis))

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        return Nodes(-torch.nn.functional.normalize(values["direction"], dim=0)[None], distant=True)

    def power(self) -> Float[Tensor, " 3"]:
        """Without end: it lights everything there is."""
        return torch.full_like(self.intensity, math.inf)

    def coordinates(self, shape_free: bool = False) -> dict[str, Coordinate]:
        return {"position": KNOWN, "direction": AXIS}

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        return cls(position, intensity, reader.direction("direction"))
