"""Panels: rectangles that shine to one side, such as ceiling lights, screens and windows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import torch
from torch import Tensor

from rgspipe.scene.lights.axial import AxialLight
from rgspipe.scene.lights.led import LedLight
from rgspipe.scene.lights.light import Light
from rgspipe.scene.lights.nodes import Nodes, square_nodes
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.lights.shape_coordinates import LENGTH, Turn
from rgspipe.scene.lights.shape_number import ShapeNumber
from rgspipe.scene.lights.surface import EvenRectangle
from rgspipe.scene.shapes import Float

#: Nodes along each side.
SIDE = 4

#: Sides that a fit begins with, in parts of the scene's size.
SIDES = (0.1, 0.25)

#: Straight up there is no shortest way from straight down; within so little of it (1 − cosine) it is one of them.
_UP = 1e-9


@dataclass(frozen=True)
class PanelLight(AxialLight):
    """A rectangle of even radiance I/(width · height) on the side that its axis points to, dark on the other.

    Its intensity along the axis is I, and falls with the cosine.

    Attributes:
        width, height: sides, scene units; exchanged, with a quarter of a turn, they are the same panel (`told`).
        turn: angle [rad] from the x-axis to the side `width`, around the axis, where the axis points straight down
            (−z); for another axis the x-axis is taken along on the shortest way there.
    """

    kind: ClassVar[str] = "panel"
    ranges: ClassVar = dict.fromkeys(("width", "height"), ("a length, 0 or more", 0.0, math.inf))

    width: float
    height: float
    turn: float = 0.0

    @classmethod
    def shaped(cls, width: float = 0.2, height: float = 0.2, turn: float = 0.0) -> Self:
        return cls([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0], width, height, turn)

    @property
    def shape(self) -> tuple[ShapeNumber, ...]:
        sides = [ShapeNumber(name, name, "", LENGTH, decimals=3) for name in ("width", "height")]
        return (*sides, ShapeNumber("turn", "turn", "°", Turn(math.pi)))

    @property
    def rim(self) -> float:
        return 1.0

    @property
    def flush(self) -> bool:
        return True

    @property
    def faces_away(self) -> bool:
        return True

    @property
    def seed(self) -> LedLight:
        return LedLight(self.position, self.intensity, self.direction, 1.0)

    @property
    def told(self) -> Self:
        """With its longer side as its width, and a turn in [−π/2, π/2)."""
        one = self if self.width >= self.height else self.exchanged
        turn = math.remainder(one.turn, math.pi)
        return replace(one, turn=turn - math.pi if turn >= 0.5 * math.pi else turn)

    @property
    def exchanged(self) -> Self:
        """The same panel with width and height exchanged: a quarter of a turn on."""
        return replace(self, width=self.height, height=self.width, turn=self.turn + 0.5 * math.pi)

    def like(self, other: Light) -> Self:
        if not isinstance(other, PanelLight):
            return self
        wanted = other.width * other.sides()[0]

        def apart(one: PanelLight) -> float:
            width = one.width * one.sides()[0]
            return min(float((width - wanted).norm()), float((width + wanted).norm()))

        return min(self, self.exchanged, key=apart)

    def profile_at(self, angle: Tensor, numbers: Mapping[str, Tensor], softness: float = 0.0) -> tuple[Tensor, Tensor]:
        """That of one of its nodes."""
        return self.seed.profile_at(angle, {"exponent": torch.ones_like(angle)}, softness)

    def kinks(self, softness: float = 0.0) -> list[float]:
        return self.seed.kinks(softness)

    def sides(self) -> tuple[Float[Tensor, " 3"], Float[Tensor, " 3"]]:
        """(3,) unit vectors along its width and its height; with its axis they are right-handed."""
        values = self.places()
        return sides(values["direction"], values["turn"])

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        across, up = sides(values["direction"], values["turn"])
        places = square_nodes(SIDE, few).to(across)
        offsets = places[:, :1] * values["width"] * across + places[:, 1:] * values["height"] * up
        surface = EvenRectangle(values["width"], values["height"], across, up)
        return Nodes(values["position"] + offsets, values["direction"], surface=surface)

    def grown(self, size: float, free: bool) -> tuple[Self, ...]:
        return tuple(replace(self, width=share * size, height=share * size) for share in SIDES) if free else (self,)

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        numbers = [reader.number(name) for name in ("width", "height", "turn")]
        return cls(position, intensity, reader.direction("direction"), *numbers)

    def emission(self, maths: Any, cosine: Any) -> Any:
        return self.seed.emission(maths, cosine)


def sides(direction: Tensor, turn: Tensor) -> tuple[Tensor, Tensor]:
    """(3,) unit vectors along width and height of a panel with an axis (3,); differentiable, also twice."""
    axis = direction / direction.norm()
    x, y, z = axis.unbind()
    # The turn of −z to the axis by the shortest way, of the x- and the y-axis.
    spread = 1.0 / (1.0 - z).clamp(min=_UP)
    first = torch.stack([1.0 - x * x * spread, -x * y * spread, x])
    second = torch.stack([x * y * spread, -1.0 + y * y * spread, -y])
    return torch.cos(turn) * first + torch.sin(turn) * second, torch.cos(turn) * second - torch.sin(turn) * first
