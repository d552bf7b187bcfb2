"""How a fit moves what it may of a light: coordinates in which equal steps have about equal effects.

A coordinate of d parameters belongs to a field of r numbers. Derivatives are taken towards the field in its own
(natural) units; `units` are those of one unit of a parameter.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import torch
from torch import Tensor


class Coordinate(ABC):
    """One field of a light, as a fit moves it."""

    #: How many parameters it has.
    count: ClassVar[int]

    #: How it goes on from frame to frame of a sequence: as a "place" or a "turn" in the world; None if it stays.
    motion: ClassVar[Literal["place", "turn"] | None] = None

    @abstractmethod
    def units(self, value: Any, size: float) -> list[float]:
        """(d,) natural change per unit of each parameter, in a scene of `size`."""

    @abstractmethod
    def moved(self, value: Any, step: Tensor, size: float) -> Any:
        """The field after a step (d,)."""

    @abstractmethod
    def offset(self, value: Any, other: Any, size: float) -> Tensor:
        """(d,) parameters of `other` over those of `value`, to first order."""

    @abstractmethod
    def distance(self, value: Any, other: Any, size: float) -> float:
        """How far apart two values are: over the scene's size, or rad."""

    def doubt(self, value: Any, deviation: float) -> float:
        """What share of a value its standard deviation is; 0 where such a share says nothing."""
        return 0.0

    def stretch(self, step: Tensor) -> tuple[float, float]:
        """How far a step (d,) moves, over the scene's size, and turns or reshapes [rad, or a parameter]."""
        return 0.0, float(step.abs().max())

    def slopes(self, value: Any, by: Tensor) -> Tensor:
        """(N, d) natural derivatives towards the parameters, from those towards the field (N, r) or (N,)."""
        return by[:, None]

    def spread(self, value: Any) -> Tensor:
        """(r, d) natural change of the field per natural change of each parameter."""
        return torch.eye(self.count, dtype=torch.float64)

    def turned(self, value: Any, other: Any) -> Tensor:
        """(d, d) from changes of the parameters at `value` to those at `other`."""
        return torch.eye(self.count, dtype=torch.float64)


class Place(Coordinate):
    """A position, in units of the scene's size."""

    count = 3
    motion = "place"

    def units(self, value: Tensor, size: float) -> list[float]:
        return [size] * 3

    def moved(self, value: Tensor, step: Tensor, size: float) -> Tensor:
        return value + size * step

    def offset(self, value: Tensor, other: Tensor, size: float) -> Tensor:
        return (other - value) / size if size > 0.0 else 0.0 * value

    def distance(self, value: Tensor, other: Tensor, size: float) -> float:
        # A scene of one surfel has no size, and no room to move in.
        return float((value - other).norm()) / size if size > 0.0 else 0.0

    def stretch(self, step: Tensor) -> tuple[float, float]:
        return float(step.norm()), 0.0

    def slopes(self, value: Tensor, by: Tensor) -> Tensor:
        return by


@dataclass(frozen=True)
class OnPlane(Place):
    """A position that stays on a plane, in units of the scene's size.

    Attributes:
        normal: (3,) float64 of unit length.
    """

    normal: Tensor
    count = 2

    def units(self, value: Tensor, size: float) -> list[float]:
        return [size] * 2

    def moved(self, value: Tensor, step: Tensor, size: float) -> Tensor:
        return value + size * step @ tangents(self.normal)

    def offset(self, value: Tensor, other: Tensor, size: float) -> Tensor:
        return tangents(self.normal) @ super().offset(value, other, size)

    def slopes(self, value: Tensor, by: Tensor) -> Tensor:
        return by @ tangents(self.normal).T.to(by)

    def spread(self, value: Tensor) -> Tensor:
        return tangents(self.normal).T


@dataclass(frozen=True)
class BeforePlane(Place):
    """A position before a plane: along it in units of the scene's size, away from it by the logarithm.

    So a lamp that hangs close to a surface keeps on its side of it, and no step takes it far away.

    Attributes:
        place, normal: (3,) float64 of the plane, the normal of unit length.
        nearest, farthest: bounds of the distance, in parts of the scene's size.
    """

    place: Tensor
    normal: Tensor
    nearest: float
    farthest: float

    def units(self, value: Tensor, size: float) -> list[float]:
        return [size, size, self._distance(value, size)]

    def moved(self, value: Tensor, step: Tensor, size: float) -> Tensor:
        grown = self._distance(value, size) * math.exp(min(max(float(step[2]), -1.0), 1.0))
        distance = min(max(grown, self.nearest * size), self.farthest * size)
        beside = value - ((value - self.place) @ self.normal) * self.normal
        return beside + size * step[:2] @ tangents(self.normal) + distance * self.normal

    def offset(self, value: Tensor, other: Tensor, size: float) -> Tensor:
        return self._axes @ (other - value) / torch.tensor(self.units(value, size), dtype=torch.float64)

    def stretch(self, step: Tensor) -> tuple[float, float]:
        return float(step[:2].norm()), float(step[2].abs())

    def slopes(self, value: Tensor, by: Tensor) -> Tensor:
        return by @ self._axes.T.to(by)

    def spread(self, value: Tensor) -> Tensor:
        return self._axes.T

    @property
    def _axes(self) -> Tensor:
        return torch.cat([tangents(self.normal), self.normal[None]])

    def _distance(self, value: Tensor, size: float) -> float:
        distance = float((value - self.place) @ self.normal)
        return min(max(distance, self.nearest * size), self.farthest * size)


class Known(Coordinate):
    """A vector that does not move."""

    count = 0

    def units(self, value: Tensor, size: float) -> list[float]:
        return []

    def moved(self, value: Tensor, step: Tensor, size: float) -> Tensor:
        return value

    def offset(self, value: Tensor, other: Tensor, size: float) -> Tensor:
        return torch.zeros(0, dtype=torch.float64)

    def distance(self, value: Tensor, other: Tensor, size: float) -> float:
        return 0.0

    def stretch(self, step: Tensor) -> tuple[float, float]:
        return 0.0, 0.0

    def slopes(self, value: Tensor, by: Tensor) -> Tensor:
        return by[:, :0]

    def spread(self, value: Tensor) -> Tensor:
        return torch.zeros(len(value), 0, dtype=torch.float64)


class Axis(Coordinate):
    """A unit vector, by two turns tangent to the sphere at where it points [rad]."""

    count = 2
    motion = "turn"

    def units(self, value: Tensor, size: float) -> list[float]:
        return [1.0, 1.0]

    def moved(self, value: Tensor, step: Tensor, size: float) -> Tensor:
        """Along the sphere (exponential map)."""
        angle = float(step.norm())
        if angle == 0.0:
            return value
        across = (step / angle) @ tangents(value)
        return torch.nn.functional.normalize(math.cos(angle) * value + math.sin(angle) * across, dim=0)

    def offset(self, value: Tensor, other: Tensor, size: float) -> Tensor:
        return tangents(value) @ (other - value)

    def distance(self, value: Tensor, other: Tensor, size: float) -> float:
        return float((value - other).norm())

    def slopes(self, value: Tensor, by: Tensor) -> Tensor:
        return by @ tangents(value).T.to(by)

    def spread(self, value: Tensor) -> Tensor:
        return tangents(value).T

    def turned(self, value: Tensor, other: Tensor) -> Tensor:
        return tangents(other) @ tangents(value).T


PLACE, AXIS, KNOWN = Place(), Axis(), Known()


def tangents(axis: Tensor) -> Tensor:
    """(2, 3) float64 unit vectors across an axis (3,) of unit length."""
    helper = torch.zeros(3, dtype=torch.float64)
    helper[int(axis.abs().argmin())] = 1.0
    first = torch.nn.functional.normalize(torch.linalg.cross(axis, helper), dim=0)
    return torch.stack([first, torch.linalg.cross(axis, first)])
