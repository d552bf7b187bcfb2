"""Measured intensities of a luminaire over all directions, interpolated smoothly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import torch
from torch import Tensor

from rgspipe.scene.by_value import ByValue

#: Columns of intensities that differ by less than this part of the largest are alike: files are rounded.
ALIKE = 1e-4


@dataclass(frozen=True)
class Photometry(ByValue):
    """Relative intensity over the angle from the axis and the angle around it (C-planes of type C photometry).

    Between the angles it is a bicubic Hermite surface whose slopes are those of monotone curves (Fritsch and Carlson
    1980; Fritsch and Butland 1984) along both angles, without twist: it has continuous first derivatives, and a jump
    of the table stays one between its two angles, without waves beside it.

    Attributes:
        vertical: (V,) rad from 0, straight along the axis, at most π; behind the last it is dark.
        horizontal: (H,) rad around the axis, from 0 and below 2π; a single one where it is the same all around.
        relative: (V, H) over the largest, in [0, 1].
        candela: the largest [cd] as measured.
        name: of the file.

    Raises:
        ValueError: angles do not rise from 0, or numbers are missing, not finite, negative or all 0.
    """

    vertical: Tensor
    horizontal: Tensor
    relative: Tensor
    candela: float = 1.0
    name: str = ""

    def __post_init__(self) -> None:
        table, limits = self.relative, ((self.vertical, math.pi + 1e-9), (self.horizontal, 2.0 * math.pi - 1e-9))
        for angles, most in limits:
            rising = bool((angles.diff() > 0.0).all()) and float(angles[-1]) <= most
            if not (rising and float(angles[0]) == 0.0):
                raise ValueError(f"angles must rise from 0 and stay within {math.degrees(most):.0f}°")
        if tuple(table.shape) != (len(self.vertical), len(self.horizontal)) or len(self.vertical) < 2:
            raise ValueError("there must be an intensity for each pair of angles, and two vertical angles")
        if not (bool(torch.isfinite(table).all()) and float(table.min()) >= 0.0 and abs(float(table.max()) - 1) < 1e-9):
            raise ValueError("relative intensities must be from 0 to 1, which one of them is")

    @classmethod
    def measured(cls, vertical: Tensor, horizontal: Tensor, candela: Tensor, name: str = "") -> Self:
        """Of a table of candela (V, H) over angles [rad]; along the axis, and against it, there is one intensity.

        Columns that are all alike are one, and those of a table that repeats itself around the axis stay.
        """
        table = candela.double().clone()
        for row, pole in ((0, 0.0), (-1, math.pi)):
            if abs(float(vertical[row]) - pole) < 1e-9:
                table[row] = table[row].mean()
        peak = float(table.max()) if table.numel() else 0.0
        if not 0.0 < peak < math.inf:
            raise ValueError("there must be an intensity above 0")
        table = table / peak
        if bool(((table - table[:, :1]).abs() <= ALIKE).all()):
            table, horizontal = table[:, :1] / table[:, :1].max(), horizontal[:1]
        return cls(vertical.double(), horizontal.double(), table, peak, name)

    @property
    def round(self) -> bool:
        """Whether it is the same all around the axis."""
        return len(self.horizontal) == 1

    @cached_property
    def period(self) -> float:
        """Angle [rad] around the axis after which it is the same again."""
        count = len(self.horizontal)
        even = torch.arange(count, dtype=torch.float64) * (2.0 * math.pi / count)
        if self.round or not torch.allclose(self.horizontal, even, atol=1e-6):
            return 2.0 * math.pi
        shifts = (k for k in range(1, count) if count % k == 0)
        alike = (k for k in shifts if bool(((self.relative.roll(k, 1) - self.relative).abs() <= ALIKE).all()))
        return 2.0 * math.pi * next(alike, count) / count

    @cached_property
    def rounded(self) -> Photometry:
        """Its mean around the axis, as intensities of the same lamp: the largest is that of the mean."""
        mean = self._mean(self.relative)
        return self if self.round else Photometry.measured(self.vertical, self.horizontal[:1], self.candela * mean)

    def _mean(self, table: Tensor) -> Tensor:
        """(V, 1) over the angle around the axis, of values (V, H) with straight lines between."""
        widths = torch.cat([self.horizontal.diff(), 2.0 * math.pi - self.horizontal[-1:]])
        return (0.5 * widths * (table + table.roll(-1, 1))).sum(dim=1, keepdim=True) / (2.0 * math.pi)

    @cached_property
    def slopes(self) -> tuple[Tensor, Tensor]:
        """(V, H) derivatives towards the vertical angle, and towards the horizontal one."""
        down = monotone_slopes(self.vertical, self.relative)
        if self.round:
            return down, torch.zeros_like(down)
        # All around: the first columns again behind the last, and the last before the first.
        turn = 2.0 * math.pi
        angles = torch.cat([self.horizontal[-2:] - turn, self.horizontal, self.horizontal[:2] + turn])
        table = torch.cat([self.relative[:, -2:], self.relative, self.relative[:, :2]], dim=1)
        return down, monotone_slopes(angles, table.T).T[:, 2:-2]

    def at(self, vertical: Tensor, horizontal: Tensor | None = None) -> Tensor:
        """(…,) relative intensity at angles [rad], differentiable once; of a round one the second is not looked at."""
        to = {"dtype": vertical.dtype, "device": vertical.device}
        knots, table, down, around = (part.to(**to) for part in (self.vertical, self.relative, *self.slopes))
        row, height, (v0, v1, s0, s1) = _hermite(knots, vertical)
        if self.round:
            top, low = (part[:, 0] for part in (table, down))
            value = v0 * top[row] + v1 * top[row + 1] + height * (s0 * low[row] + s1 * low[row + 1])
        else:
            turn = 2.0 * math.pi
            angles = torch.cat([self.horizontal.to(**to), torch.full((1,), turn, **to)])
            column, width, (h0, h1, t0, t1) = _hermite(angles, horizontal % turn)
            after = (column + 1) % len(self.horizontal)

            def line(one: Tensor) -> Tensor:
                across = h0 * table[one, column] + h1 * table[one, after]
                return across + width * (t0 * around[one, column] + t1 * around[one, after])

            def slope(one: Tensor) -> Tensor:
                return h0 * down[one, column] + h1 * down[one, after]

            value = v0 * line(row) + v1 * line(row + 1) + height * (s0 * slope(row) + s1 * slope(row + 1))
        # Where slopes of two columns cancel, the surface may leave the table's range by little.
        return torch.where(vertical <= knots[-1], value.clamp(0.0, 1.0), torch.zeros_like(value))


def monotone_slopes(places: Tensor, values: Tensor) -> Tensor:
    """(K, C) slopes of curves through values (K, C) at places (K,) that rise and fall only where the values do.

    Inside the weighted harmonic mean of the slopes on both sides, 0 where these differ in sign; at the first end flat,
    so that a light has no cone's tip along its axis; at the last one straight.
    """
    widths, slopes = places.diff()[:, None], values.diff(dim=0) / places.diff()[:, None]
    before, after, left, right = slopes[:-1], slopes[1:], widths[:-1], widths[1:]
    same = before * after > 0.0
    one, other = 2.0 * right + left, right + 2.0 * left
    safe = (torch.where(same, part, torch.ones_like(part)) for part in (before, after))
    inside = torch.where(same, (one + other) / sum(w / s for w, s in zip((one, other), safe, strict=True)), 0.0)
    flat = torch.zeros_like(values[:1])
    return torch.cat([flat, inside, slopes[-1:]])


def _hermite(knots: Tensor, angle: Tensor) -> tuple[Tensor, Tensor, tuple[Tensor, ...]]:
    """(…,) interval of an angle, its width, and the four cubic Hermite polynomials there."""
    index = (torch.searchsorted(knots, angle.detach().contiguous(), right=True) - 1).clamp(0, len(knots) - 2)
    width = knots[index + 1] - knots[index]
    t = ((angle - knots[index]) / width).clamp(0.0, 1.0)
    square = t * t
    rise = square * (3.0 - 2.0 * t)
    return index, width, (1.0 - rise, rise, t * (1.0 - t) ** 2, square * (t - 1.0))
