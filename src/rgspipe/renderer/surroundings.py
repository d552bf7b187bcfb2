"""Where lights may be: within a closed scene and a little around it, far around an open one."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.point_sets import fibonacci_directions

#: Scenes that see more than this of their surroundings are open: lights may stand far from them.
OPEN = 0.5

#: How far outside the bounding box of a closed scene a light may go, in parts of the scene's size.
MARGIN = 0.25

#: How far from the middle of an open scene, in its radii; four are the published method's.
REACH = 4.0

#: Radii of the shells of candidates around an open scene, and how many directions each has. Light from afar changes
#: little from one shell to the next.
SHELLS, DIRECTIONS = (1.0, 1.35, 1.8, 2.4, 3.2), 96


@dataclass(frozen=True)
class Surroundings:
    """A scene's bounding box, and whether there is room for lights around it.

    Attributes:
        lower, upper: (3,) float64 corners on the CPU, scene units.
        size: longest side.
        open: whether the scene is an object, or a few, in empty space.
    """

    lower: Tensor
    upper: Tensor
    size: float
    open: bool

    @property
    def middle(self) -> Tensor:
        """(3,) of the box."""
        return 0.5 * (self.lower + self.upper)

    @property
    def radius(self) -> float:
        """Half of the diagonal."""
        return 0.5 * float((self.upper - self.lower).norm())

    @property
    def bounds(self) -> tuple[Tensor, Tensor]:
        """(3,) lower and upper corner of where lights are looked for, float64."""
        if not self.open:
            return self.lower - MARGIN * self.size, self.upper + MARGIN * self.size
        return self.middle - REACH * self.radius, self.middle + REACH * self.radius

    def shell_points(self) -> Tensor:
        """(C, 3) float64 candidates around an open scene, spread evenly over shells, on each in other directions."""
        shells = [
            self.middle + radius * self.radius * fibonacci_directions(DIRECTIONS + index).double()
            for index, radius in enumerate(SHELLS)
        ]
        return torch.cat(shells)
