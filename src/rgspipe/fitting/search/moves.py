"""How a rig moves in one step of a refinement: not too far, within the region, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.fitting.model.parameters import Emitter
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
        return torch.minimum(torch.maximum(position, self.lower), self.upper)

    def at_bound(self, position: Tensor) -> bool:
        near = 1e-6 * self.size
        return bool(((position - self.lower < near) | (self.upper - position < near)).any())


@dataclass(frozen=True)
class StepLimits:
    """The longest step: as far as derivatives at its start may be trusted.

    Attributes:
        move: of a position, a part of the scene's size.
        turn: of an axis [rad], and of the transformed parameters of a cone.
    """

    move: float = 0.12
    turn: float = 0.3

    def allowed(self, rig: Sequence[Emitter], step: Tensor) -> float:
        """By which part a step (D,) of the parameters of all lights has to be shortened."""
        return min(self._allowed(emitter, part) for emitter, part in _parts(rig, step))

    def _allowed(self, emitter: Emitter, step: Tensor) -> float:
        share = within(float(step[:3].norm()), self.move)
        return min(share, within(float(step[3:].abs().max()), self.turn)) if emitter.is_spot else share


def moved_rig(rig: Sequence[Emitter], step: Tensor, region: Region) -> tuple[Emitter, ...]:
    """The lights after a step (D,); one that does not move is the same object."""
    moved = []
    for emitter, part in _parts(rig, step):
        other = emitter.moved(part, region.size)
        other = replace(other, position=region.clip(other.position))
        moved.append(emitter if float(part.abs().max()) == 0.0 else other)
    return tuple(moved)


def rig_move(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> float:
    """The largest `emitter_distance` of a light from itself."""
    return max(emitter_distance(a, b, size) for a, b in zip(one, other, strict=True))


def emitter_distance(one: Emitter, other: Emitter, size: float) -> float:
    """The largest of the move over the scene's size, the turn of the axis and the change of the cone [rad]."""
    # A scene of one surfel has no size, and no room to move in.
    moved = float((one.position - other.position).norm()) / size if size > 0.0 else 0.0
    if not one.is_spot:
        return moved
    turned = float((one.axis - other.axis).norm())
    changed = abs(one.shape.cone_angle - other.shape.cone_angle)
    if one.shape.profile == "gaussian":
        changed = max(changed, abs(one.shape.falloff - other.shape.falloff))
    return max(moved, turned, changed)


def _parts(rig: Sequence[Emitter], step: Tensor) -> list[tuple[Emitter, Tensor]]:
    """Each light with its part of a step (D,)."""
    return list(zip(rig, step.split([emitter.parameters for emitter in rig]), strict=True))
