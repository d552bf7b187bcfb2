"""How a rig moves in one step of a refinement: not too far, within the region, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import StepLimits
from rgspipe.optim.levenberg_marquardt import within
from rgspipe.renderer.frozen import FrozenScene


@dataclass(frozen=True)
class Region:
    """Where lights may be.

    Attributes:
        lower, upper: (3,) float64 corners.
        size: the scene's, scene units.
    """

    lower: Tensor
    upper: Tensor
    size: float

    @classmethod
    def of(cls, frozen: FrozenScene) -> Region:
        """Where lights are looked for in a scene; see `renderer.surroundings`."""
        return cls(*frozen.surroundings.bounds, frozen.size)

    def clip(self, position: Tensor) -> Tensor:
        """The nearest place (3,) inside."""
        return torch.minimum(torch.maximum(position, self.lower), self.upper)

    def at_bound(self, position: Tensor) -> bool:
        """Whether a place (3,) lies on its surface."""
        near = 1e-6 * self.size
        return bool(((position - self.lower < near) | (self.upper - position < near)).any())


def allowed_share(rig: Sequence[Emitter], step: Tensor, limits: StepLimits) -> float:
    """By which part a step (D,) of the parameters of all lights has to be shortened."""
    stretches = [emitter.stretch(part) for emitter, part in _parts(rig, step)]
    return min(min(within(moved, limits.move), within(turned, limits.turn)) for moved, turned in stretches)


def moved_rig(rig: Sequence[Emitter], step: Tensor, region: Region) -> tuple[Emitter, ...]:
    """The lights after a step (D,); one that does not move is the same object."""
    moved = []
    for emitter, part in _parts(rig, step):
        other = emitter.moved(part, region.size)
        other = other.placed(region.clip(other.position))
        moved.append(emitter if float(part.abs().max()) == 0.0 else other)
    return tuple(moved)


def rig_move(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> float:
    """The largest `Emitter.distance` of a light from itself."""
    return max(a.distance(b, size) for a, b in zip(one, other, strict=True))


def _parts(rig: Sequence[Emitter], step: Tensor) -> list[tuple[Emitter, Tensor]]:
    """Each light with its part of a step (D,)."""
    return list(zip(rig, step.split([emitter.parameters for emitter in rig]), strict=True))
