"""How far one step of a fit may move lights: as far as derivatives at its start may be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.optim.levenberg_marquardt import within


@dataclass(frozen=True)
class StepLimits:
    """The longest step.

    Attributes:
        move: of a position, a part of the scene's size.
        turn: of an axis [rad], and of the parameters of a shape.
    """

    move: float = 0.12
    turn: float = 0.3

    def allowed(self, emitter: Emitter, step: Tensor) -> float:
        """By which part a step (d,) of a light's parameters has to be shortened."""
        moved, turned = emitter.stretch(step)
        return min(within(moved, self.move), within(turned, self.turn))


def allowed_share(emitters: Sequence[Emitter], step: Tensor, limits: StepLimits) -> float:
    """By which part a step (D,) of the parameters of all lights has to be shortened."""
    parts = step.split([emitter.parameters for emitter in emitters])
    return min(limits.allowed(emitter, part) for emitter, part in zip(emitters, parts, strict=True))
