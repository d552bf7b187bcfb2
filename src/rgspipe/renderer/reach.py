"""How much of a light reaches a scene, beside one as far away: next to none from inside of things or behind walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import torch
from torch import Tensor

from rgspipe.renderer.surroundings import Surroundings

#: A light that sends less than this share of the best one's flux to the scene's front sides is inside a solid, or
#: behind a wall or a floor. Of 490 candidates around a heap on a floor, 225 of which are below it, 298 are left, and
#: 309 or 280 by half or twice as much; of 472 within it 471, and 472 or 470.
LEAST_FLUX = 0.02


@dataclass(frozen=True)
class Reach:
    """The flux to a scene's front sides from the best places.

    Attributes:
        surroundings: the scene's.
        inside: of a unit light in the scene's bounding box.
        outside: of one outside of it, times the square of its distance from the middle over the scene's radius.
    """

    surroundings: Surroundings
    inside: float
    outside: float

    @classmethod
    def of(cls, surroundings: Surroundings, positions: Tensor, flux: Tensor) -> Self:
        """As unit lights at `positions` (C, 3) show it, which send `flux` (C,)."""
        within, levels = _within(surroundings, positions), _levels(surroundings, positions, flux)
        inside, outside = (float(levels[chosen].amax()) if bool(chosen.any()) else 0.0 for chosen in (within, ~within))
        return cls(surroundings, inside or outside, outside or inside)

    def shares(self, positions: Tensor, flux: Tensor) -> Tensor:
        """(L,) float64 on the CPU: `flux` (L,) of unit lights over that of the best as far away; 0 if there is none.

        Args:
            positions: (L, 3), scene units.
        """
        within, levels = _within(self.surroundings, positions), _levels(self.surroundings, positions, flux)
        best = levels.new_tensor([self.outside, self.inside])[within.long()]
        return torch.where(best > 0.0, levels / best.clamp(min=torch.finfo(torch.float64).tiny), 0.0)


def _within(surroundings: Surroundings, positions: Tensor) -> Tensor:
    """(L,) bool: the places in the scene's bounding box."""
    places = positions.double().cpu()
    return ((places >= surroundings.lower) & (places <= surroundings.upper)).all(dim=1)


def _levels(surroundings: Surroundings, positions: Tensor, flux: Tensor) -> Tensor:
    """(L,) float64: the flux; of a light outside of the scene's ball that of one as bright from there on the ball."""
    distance = (positions.double().cpu() - surroundings.middle).norm(dim=1)
    radius = max(surroundings.radius, torch.finfo(torch.float64).tiny)
    return flux.double().cpu() * (distance / radius).clamp(min=1.0).square()
