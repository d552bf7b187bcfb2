"""Lights in motion: what the frames so far tell of the next one, as a Kalman filter over parameters and their rates.

Parameters go on at the rates that they have, and a rate changes from frame to frame by a random amount; intensities and
cones hardly change (white-noise acceleration; Bar-Shalom, Li and Kirubarajan 2001, chapter 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import MotionOptions
from rgspipe.fitting.search.starts import EmitterRig

#: Standard deviations of what views do not tell at all: a place anywhere in the scene, any axis, any intensity.
NOTHING_KNOWN = 1.0


@dataclass(frozen=True)
class Motion:
    """What is known of L moving lights at a frame.

    Unknowns are the D parameters of all lights (see `Emitter`), then their intensities over `reference`, light after
    light; and M rates, the changes a frame of positions and axes.

    Attributes:
        rig: the expected lights.
        intensity: (L, 3) float64 W/sr.
        reference: (L,) float64 W/sr, unit of the intensities in the covariance.
        rates: (M,) float64.
        covariance: (D + 3L + M,) * 2 float64.
        size: the scene's, scene units.
        together: whether one thing carries the lights, so that they move and turn together.
        options: how lights may move.
    """

    rig: EmitterRig
    intensity: Tensor
    reference: Tensor
    rates: Tensor
    covariance: Tensor
    size: float
    together: bool = False
    options: MotionOptions = field(default_factory=MotionOptions)

    @classmethod
    def starting(
        cls,
        rig: EmitterRig,
        intensity: Tensor,
        information: Tensor,
        size: float,
        together: bool = False,
        options: MotionOptions | None = None,
    ) -> Motion:
        """At rest, with the information (D + 3L,) * 2 that a first frame gives."""
        known = torch.linalg.inv(information + torch.eye(len(information)).double() / NOTHING_KNOWN**2)
        options = options or MotionOptions()
        rates = _rate_covariance(rig, options.rate, options.alike if together else 0.0)
        still = torch.zeros(len(rates), dtype=torch.float64)
        covariance = torch.block_diag(known, rates)
        return cls(rig, intensity, references(intensity), still, covariance, size, together, options)

    @property
    def unknowns(self) -> int:
        """D + 3L."""
        return len(self.covariance) - len(self.rates)

    def predicted(self) -> Motion:
        """One frame later, before it is looked at."""
        moving, count = moving_parameters(self.rig), self.unknowns
        step = torch.zeros(_parameters(self.rig), dtype=torch.float64)
        step[moving] = self.rates
        parts = step.split([emitter.parameters for emitter in self.rig])
        rig = tuple(one.moved(part, self.size) for one, part in zip(self.rig, parts, strict=True))
        turned = turns(self.rig, rig)
        forward = torch.eye(len(self.covariance), dtype=torch.float64)
        forward[moving, count + torch.arange(len(moving))] = 1.0
        basis = torch.block_diag(turned, torch.eye(count - len(turned)).double(), turned[moving][:, moving])
        forward = basis @ forward
        drift = torch.full((count,), self.options.change, dtype=torch.float64)
        drift[moving] = 0.0
        rates = _rate_covariance(self.rig, self.options.rate_change, self.options.alike if self.together else 0.0)
        noise = torch.block_diag(torch.diag(drift.square()), rates)
        covariance = forward @ (self.covariance + noise) @ forward.T
        return replace(self, rig=rig, rates=turned[moving][:, moving] @ self.rates, covariance=covariance)

    def released(self) -> Motion:
        """The same lights, which may have moved, turned and changed in any way: they are only where to start from."""
        return replace(self, covariance=self.covariance + NOTHING_KNOWN**2 * torch.eye(len(self.covariance)).double())

    def updated(self, rig: EmitterRig, intensity: Tensor, information: Tensor) -> Motion:
        """After a frame whose images, with what was predicted here, led to `rig` and `intensity`.

        Args:
            information: (D + 3L,) * 2 of the images alone, in the parameters of `rig`.
        """
        count = self.unknowns
        moved = torch.cat(
            [offset(self.rig, rig, self.size), ((intensity - self.intensity) / self.reference[:, None]).flatten()]
        )
        gain = torch.linalg.solve(self.covariance[:count, :count], self.covariance[:count, count:]).T
        turned = turns(self.rig, rig)
        moving = moving_parameters(rig)
        basis = torch.block_diag(turned, torch.eye(count - len(turned)).double(), turned[moving][:, moving])
        before = basis @ self.covariance @ basis.T
        seen = torch.zeros_like(before)
        seen[:count, :count] = information
        covariance = before @ torch.linalg.inv(torch.eye(len(before)).double() + seen @ before)
        rates = turned[moving][:, moving] @ (self.rates + gain @ moved)
        return replace(self, rig=rig, intensity=intensity, rates=rates, covariance=0.5 * (covariance + covariance.T))

    def position_errors(self) -> list[float]:
        """Per light the error that is to be expected of its position, root mean square over the scene's size.

        Of suns it is that of the direction [rad].
        """
        pairs = zip(self.rig, self.light_covariances(), strict=True)
        spreads = [emitter.light.standing_spread(covariance, self.size) for emitter, covariance in pairs]
        return [float(spread.diagonal().clamp(min=0.0).sum().sqrt()) / self.size for spread in spreads]

    def light_covariances(self) -> tuple[Tensor, ...]:
        """Per light the covariance of its natural parameters and intensity; see `FitResult.covariance`."""
        parameters, found, first = _parameters(self.rig), [], 0
        for index, emitter in enumerate(self.rig):
            colours = parameters + 3 * index + torch.arange(3)
            chosen = torch.cat([first + torch.arange(emitter.parameters), colours])
            natural = emitter.spread() * emitter.units(self.size)
            spread = torch.block_diag(natural, self.reference[index] * torch.eye(3).double())
            found.append(spread @ self.covariance[chosen][:, chosen] @ spread.T)
            first += emitter.parameters
        return tuple(found)


def references(intensity: Tensor) -> Tensor:
    """(L,) units of intensities (L, 3): each light's mean, or a part of the strongest one's where that is tiny."""
    means = intensity.mean(dim=1)
    return means.clamp(min=max(1e-3 * float(means.max()), 1e-300))


def moving_parameters(rig: EmitterRig) -> Tensor:
    """(M,) int64 which of the D parameters are positions and axes."""
    return torch.cat([emitter.moving() for emitter in rig]).nonzero()[:, 0]


def offset(start: EmitterRig, end: EmitterRig, size: float) -> Tensor:
    """(D,) parameters of `end` over those of `start`, axes in the tangents at `start`."""
    return torch.cat([one.offset(other, size) for one, other in zip(start, end, strict=True)])


def turns(start: EmitterRig, end: EmitterRig) -> Tensor:
    """(D, D) from changes of the parameters at `start` to those at `end`: axes have other tangents there."""
    return torch.block_diag(*(one.turned(other) for one, other in zip(start, end, strict=True)))


def _parameters(rig: Sequence[Emitter]) -> int:
    return sum(emitter.parameters for emitter in rig)


def _rate_covariance(rig: EmitterRig, scales: tuple[float, float], alike: float) -> Tensor:
    """(M, M) of random rates with standard deviations `scales` of positions and axes, and a correlation of lights."""
    rows = [emitter.carried(*scales) for emitter in rig]
    alone = torch.block_diag(*(row @ row.T for row in rows))
    if alike == 0.0:
        return alone
    common = torch.cat(rows)
    return alike * common @ common.T + (1.0 - alike) * alone
