"""A box that stands in a room."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.arguments import as_number
from rgspipe.errors import InputError
from rgspipe.scene.arrays import as_tensor, check_finite
from rgspipe.scene.rectangles import Rectangles, solid_box

Vector = tuple[float, float, float]


def as_vector(name: str, values: Vector, expected: str) -> Tensor:
    """(3,) float64.

    Raises:
        InputError: they are not three finite numbers.
    """
    made = as_tensor(values, name, (3,), torch.float64, f"Pass {expected}.")
    check_finite(made, name, f"Pass {expected}.")
    return made


def check_lengths(name: str, values: Vector) -> None:
    """Refuse what are not three lengths."""
    _check(name, values, "three lengths above 0", math.nextafter(0.0, 1.0), math.inf)


def check_albedo(name: str, values: Vector) -> None:
    """Refuse what is no reflectance RGB."""
    _check(name, values, "three reflectances from 0 to 1", 0.0, 1.0)


def _check(name: str, values: Vector, expected: str, low: float, high: float) -> None:
    if not all(low <= value <= high for value in as_vector(name, values, expected).tolist()):
        raise InputError(name, expected=expected, found=f"{values!r:.80}", remedy="Correct it.")


@dataclass(frozen=True)
class Box:
    """A solid box.

    Attributes:
        center: scene units.
        size: edge lengths, scene units.
        turn: rotation about +z, rad.
        albedo: diffuse reflectance RGB.

    Raises:
        InputError: a number is not finite, a length not above 0, or an albedo not from 0 to 1.
    """

    center: Vector
    size: Vector
    turn: float
    albedo: Vector = (0.73, 0.73, 0.73)

    def __post_init__(self) -> None:
        as_vector("center", self.center, "a place: three finite numbers")
        check_lengths("size", self.size)
        as_number(self.turn, "turn", "Pass an angle in radians.")
        check_albedo("albedo", self.albedo)

    def rectangles(self) -> Rectangles:
        """Its six faces, which face outwards; that on which it stands is there too."""
        return solid_box(self.center, self.size, self.albedo, self.turn)
