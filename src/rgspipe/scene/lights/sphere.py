"""Spheres that shine: bulbs and globes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from torch import Tensor

from rgspipe.scene.lights.light import WATTS_PER_INTENSITY, Light
from rgspipe.scene.lights.nodes import Nodes, ball_nodes
from rgspipe.scene.lights.point import PointLight
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.lights.shape_coordinates import LENGTH
from rgspipe.scene.lights.shape_number import ShapeNumber
from rgspipe.scene.lights.surface import EvenSphere
from rgspipe.scene.shapes import Float

#: Radii that a fit begins with, in parts of the scene's size: where the radius is 0, nothing tells which way it goes.
RADII = (0.02, 0.06)


@dataclass(frozen=True)
class SphereLight(Light):
    """A sphere of even radiance I/(πr²): seen whole, it lights surfaces as a point of intensity I in its middle does.

    Attributes:
        radius: r ≥ 0, scene units.
    """

    kind: ClassVar[str] = "sphere"
    ranges: ClassVar = {"radius": ("a radius, 0 or more", 0.0, math.inf)}

    radius: float

    @classmethod
    def shaped(cls, radius: float = 0.05) -> Self:
        return cls([0.0, 0.0, 0.0], 1.0, radius)

    @property
    def shape(self) -> tuple[ShapeNumber, ...]:
        return (ShapeNumber("radius", "radius", "", LENGTH, decimals=4),)

    @property
    def plain(self) -> PointLight:
        return PointLight(self.position, self.intensity)

    @property
    def seed(self) -> PointLight:
        return self.plain

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        places = values["position"] + values["radius"] * ball_nodes(few).to(values["position"])
        return Nodes(places, surface=EvenSphere(values["radius"]))

    def grown(self, size: float, free: bool) -> tuple[Self, ...]:
        return tuple(replace(self, radius=share * size) for share in RADII) if free else (self,)

    def power(self) -> Float[Tensor, " 3"]:
        return WATTS_PER_INTENSITY * self.intensity

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        return cls(position, intensity, reader.number("radius"))
