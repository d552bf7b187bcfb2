"""How a fit moves the numbers of a light's shape, each by one parameter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.scene.lights.coordinates import Coordinate


@dataclass(frozen=True)
class Between(Coordinate):
    """A number between two bounds, by its logit."""

    low: float
    high: float
    count = 1

    def units(self, value: float, size: float) -> list[float]:
        inside = min(max(value, self.low), self.high)
        return [max((inside - self.low) * (self.high - inside) / (self.high - self.low), 1e-4)]

    def moved(self, value: float, step: Tensor, size: float) -> float:
        span = self.high - self.low
        share = min(max((value - self.low) / span, 1e-6), 1.0 - 1e-6)
        logit = math.log(share / (1.0 - share)) + float(step[0])
        return self.low + span / (1.0 + math.exp(-min(max(logit, -30.0), 30.0)))

    def offset(self, value: float, other: float, size: float) -> Tensor:
        return torch.tensor([other - value], dtype=torch.float64) / self.units(value, size)[0]

    def distance(self, value: float, other: float, size: float) -> float:
        return abs(value - other)


@dataclass(frozen=True)
class Positive(Coordinate):
    """A number above zero, by its logarithm, within bounds."""

    low: float
    high: float
    count = 1

    def units(self, value: float, size: float) -> list[float]:
        return [max(value, self.low)]

    def moved(self, value: float, step: Tensor, size: float) -> float:
        grown = max(value, self.low) * math.exp(min(max(float(step[0]), -3.0), 3.0))
        return min(max(grown, self.low), self.high)

    def offset(self, value: float, other: float, size: float) -> Tensor:
        return torch.tensor([other - value], dtype=torch.float64) / self.units(value, size)[0]

    def distance(self, value: float, other: float, size: float) -> float:
        return abs(value - other)


class Ratio(Positive):
    """A `Positive` number of which only ratios tell how much it changes."""

    def distance(self, value: float, other: float, size: float) -> float:
        return abs(math.log(max(value, self.low) / max(other, self.low)))


class Length(Coordinate):
    """A length, in units of the scene's size. A length below zero is that above it: what has it is turned around."""

    count = 1

    def units(self, value: float, size: float) -> list[float]:
        return [size]

    def moved(self, value: float, step: Tensor, size: float) -> float:
        return abs(value + size * float(step[0]))

    def offset(self, value: float, other: float, size: float) -> Tensor:
        return torch.tensor([(other - value) / size if size > 0.0 else 0.0], dtype=torch.float64)

    def distance(self, value: float, other: float, size: float) -> float:
        return abs(value - other) / size if size > 0.0 else 0.0

    def doubt(self, value: float, deviation: float) -> float:
        return deviation / value if value > 0.0 else math.inf


@dataclass(frozen=True)
class Turn(Coordinate):
    """An angle [rad] after which everything is as before."""

    period: float
    count = 1

    def units(self, value: float, size: float) -> list[float]:
        return [1.0]

    def moved(self, value: float, step: Tensor, size: float) -> float:
        return math.remainder(value + float(step[0]), self.period)

    def offset(self, value: float, other: float, size: float) -> Tensor:
        return torch.tensor([math.remainder(other - value, self.period)], dtype=torch.float64)

    def distance(self, value: float, other: float, size: float) -> float:
        return abs(math.remainder(value - other, self.period))

    def doubt(self, value: float, deviation: float) -> float:
        """Over the deviation of an angle of which nothing is known."""
        return deviation / (self.period / math.sqrt(12.0))


LENGTH = Length()
