"""Measured luminaires: lights with the intensities of a table, such as IES and EULUMDAT files hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import torch
from torch import Tensor
from torch.autograd.functional import jacobian

from rgspipe.scene.lights.axial import AxialLight
from rgspipe.scene.lights.coordinates import Coordinate
from rgspipe.scene.lights.light import Light, RelativeIntensity
from rgspipe.scene.lights.panel import sides
from rgspipe.scene.lights.photometry import Photometry
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.lights.shape_coordinates import Turn
from rgspipe.scene.lights.shape_number import ShapeNumber
from rgspipe.scene.shapes import Float

#: Turns that a search tries, where a light is not round, of each period.
TURNS = 6

#: Nearer to the axis than this part of the way, a point has no direction around it.
_ON_AXIS = 1e-9


def _cosine() -> Photometry:
    """What a lamp of which nothing was measured is like: Lambertian."""
    vertical = torch.deg2rad(torch.linspace(0.0, 90.0, 37, dtype=torch.float64))
    return Photometry(vertical, torch.zeros(1).double(), torch.cos(vertical).clamp(min=0.0)[:, None])


@dataclass(frozen=True)
class ProfileLight(AxialLight):
    """A light whose intensity is a table's: `intensity` where that is largest, elsewhere its part.

    Attributes:
        turn: angle [rad] around the axis, as that of a panel: at 0 the plane C0 is along x where the light looks
            straight down.
        table: relative intensities.
        catalogue: further tables, of which a search may choose one.
        averaged: whether it is the same all around its axis, with the mean of its table; a search begins so.
    """

    kind: ClassVar[str] = "profile"
    tabulated: ClassVar[bool] = True

    turn: float
    table: Photometry
    catalogue: tuple[Photometry, ...] = ()
    averaged: bool = False

    @classmethod
    def shaped(cls, turn: float = 0.0, table: Photometry | None = None) -> Self:
        return cls([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0], turn, table or _cosine())

    @property
    def label(self) -> str:
        return f"{self.kind} {self.table.name}".strip()

    @property
    def round(self) -> bool:
        """Whether it is the same all around its axis."""
        return self.averaged or self.table.round

    @property
    def shape(self) -> tuple[ShapeNumber, ...]:
        return (ShapeNumber("turn", "turn", "°", None if self.round else Turn(self.table.period)),)

    @property
    def rim(self) -> float:
        return math.inf

    @property
    def seed(self) -> Self:
        return self if self.round else replace(self, averaged=True)

    def with_tables(self, table: Photometry, *others: Photometry) -> Self:
        return replace(self, table=table, catalogue=others)

    def variants(self) -> tuple[Self, ...]:
        tables = (self.table, *self.catalogue)
        return tuple(replace(self, table=table, catalogue=()) for table in tables)

    def grown(self, size: float, free: bool) -> tuple[Self, ...]:
        """Turned in steps."""
        steps = (step / TURNS * self.table.period for step in range(1 if self.round else TURNS))
        return tuple(replace(self, turn=math.remainder(self.turn + step, 2.0 * math.pi)) for step in steps)

    def in_place_of(self, found: Light) -> Self:
        placed = super().in_place_of(found)
        return replace(placed, table=found.table) if isinstance(found, ProfileLight) else placed

    def same_sort(self, other: Light) -> bool:
        return isinstance(other, ProfileLight) and (self.table is other.table or self.table == other.table)

    def coordinates(self, shape_free: bool = False) -> dict[str, Coordinate]:
        """The turn is a part of how it hangs, and always looked for."""
        return super().coordinates(shape_free=True)

    def profile_at(self, angle: Tensor, numbers: Mapping[str, Tensor], softness: float = 0.0) -> tuple[Tensor, Tensor]:
        """The mean around the axis. There is no edge that could be softer."""
        leaf = angle.detach().clone().requires_grad_()
        with torch.enable_grad():
            (slope,) = torch.autograd.grad(self.table.rounded.at(leaf).sum(), leaf)
        share = self.table.rounded.candela / self.table.candela
        # The slope of what is asked for, in a form that autograd can follow.
        value = share * self.table.rounded.at(angle)
        return value, share * slope

    def kinks(self, softness: float = 0.0) -> list[float]:
        return self.table.vertical.tolist()

    def relative_intensity_towards(self, points: Float[Tensor, "N 3"]) -> Float[Tensor, " N"]:
        if self.round:
            return super().relative_intensity_towards(points)
        towards = points - self.position.to(points)
        return self._around(torch.stack([towards @ axis.to(points) for axis in self.frame()], dim=1))

    def relative_intensity(
        self, points: Float[Tensor, "N 3"], *, softness: float = 0.0, shape_free: bool = False
    ) -> RelativeIntensity:
        if self.round:
            found = super().relative_intensity(points, softness=softness, shape_free=shape_free)
            return RelativeIntensity(found.value, {"turn": torch.zeros_like(found.value), **found.by})
        towards = (points.double() - self.position.detach().to(points.device, torch.float64)).float()
        frame = torch.stack(self.frame()).to(towards).detach()
        local = (towards @ frame.T).requires_grad_()
        with torch.enable_grad():
            value = self._around(local)
            (slope,) = torch.autograd.grad(value.sum(), local)
        local = local.detach()
        by_turn = slope[:, 0] * local[:, 1] - slope[:, 1] * local[:, 0]
        by = {"position": -slope @ frame, "direction": self._by_axis(towards, slope), "turn": by_turn}
        return RelativeIntensity(value.detach(), by)

    @property
    def least_relative_intensity(self) -> float:
        reaches_round = float(self.table.vertical[-1]) > math.pi - 1e-9
        return float(self.table.relative.min()) if reaches_round else 0.0

    def frame(self) -> tuple[Float[Tensor, " 3"], Float[Tensor, " 3"], Float[Tensor, " 3"]]:
        """Unit vectors along C0, along C90 and along the axis, float64."""
        axis = torch.nn.functional.normalize(self.direction.double(), dim=0)
        return (*sides(axis, torch.as_tensor(self.turn, dtype=torch.float64)), axis)

    def file_fields(self) -> dict[str, object]:
        table = self.table
        angles = {name: getattr(table, name).tolist() for name in ("vertical", "horizontal")}
        intensities = {"relative": table.relative.reshape(-1).tolist(), "candela": table.candela}
        return super().file_fields() | {"luminaire": table.name} | angles | intensities

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Self:
        vertical, horizontal, relative = (reader.numbers(key) for key in ("vertical", "horizontal", "relative"))
        if len(relative) != len(vertical) * len(horizontal):
            raise ValueError(f"{len(vertical)} × {len(horizontal)} relative intensities, not {len(relative)}")
        known = reader.number("candela"), reader.text("luminaire")
        table = Photometry(vertical, horizontal, relative.reshape(len(vertical), -1), *known)
        return cls(position, intensity, reader.direction("direction"), reader.number("turn"), table)

    def emission(self, maths: Any, cosine: Any) -> Any:
        """Of the mean around the axis: its pieces one after the other, each flat before and behind its own angles."""
        table = self.table.rounded
        share, angles = table.candela / self.table.candela, table.vertical.tolist()
        values, slopes = (part[:, 0].tolist() for part in (table.relative, table.slopes[0]))
        angle, total = maths.arccosine(cosine), share * values[0]
        for k, (low, high) in enumerate(pairwise(angles)):
            rise, one, other = values[k + 1] - values[k], (high - low) * slopes[k], (high - low) * slopes[k + 1]
            cubic = (one + other - 2.0 * rise, 3.0 * rise - 2.0 * one - other, one)
            if any(cubic):
                t = maths.linear(angle, low, high)
                part = maths.add(maths.multiply(share * cubic[0], t), share * cubic[1])
                part = maths.add(maths.multiply(part, t), share * cubic[2])
                total = maths.add(total, maths.multiply(part, t))
        within = maths.subtract(1.0, maths.greater_than(angle, angles[-1]))
        return maths.multiply(maths.maximum(total, 0.0), within)

    def _around(self, local: Tensor) -> Tensor:
        """(N,) relative intensity towards (N, 3) in the light's own frame."""
        x, y, z = local.unbind(dim=1)
        square, length = x * x + y * y, local.detach().norm(dim=1).clamp(min=1e-30)
        beside = square.detach() > (_ON_AXIS * length) ** 2
        across = torch.where(beside, square, (_ON_AXIS * length) ** 2).sqrt()
        around = torch.atan2(torch.where(beside, y, torch.zeros_like(y)), torch.where(beside, x, torch.ones_like(x)))
        return self.table.at(torch.atan2(across, z), around)

    def _by_axis(self, towards: Tensor, slope: Tensor) -> Tensor:
        """(N, 3) derivative towards the direction, which carries the frame along."""
        turn = torch.as_tensor(self.turn, dtype=torch.float64).detach()

        def frame(direction: Tensor) -> Tensor:
            axis = direction / direction.norm()
            return torch.stack([*sides(axis, turn), axis])

        turned = jacobian(frame, self.direction.detach().double()).to(towards)
        return torch.einsum("nk,kcd,nc->nd", slope, turned, towards)
