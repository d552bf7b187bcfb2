"""Where lights are looked for: within a closed scene and a little around it, far around an open one."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.renderer.frozen import FrozenScene
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


def is_open(frozen: FrozenScene) -> bool:
    """Whether the scene is an object, or a few, in empty space."""
    return frozen.openness > OPEN


def region_bounds(frozen: FrozenScene) -> tuple[Tensor, Tensor]:
    """(3,) lower and upper corner of where lights are looked for, float64."""
    lower, upper = (corner.double().cpu() for corner in frozen.bounds)
    if not is_open(frozen):
        return lower - MARGIN * frozen.size, upper + MARGIN * frozen.size
    middle, reach = 0.5 * (lower + upper), REACH * _radius(lower, upper)
    return middle - reach, middle + reach


def shell_points(frozen: FrozenScene) -> Tensor:
    """(C, 3) float32 candidates around an open scene, spread evenly over shells, on each in other directions."""
    lower, upper = (corner.double().cpu() for corner in frozen.bounds)
    shells = [
        0.5 * (lower + upper) + radius * _radius(lower, upper) * fibonacci_directions(DIRECTIONS + index).double()
        for index, radius in enumerate(SHELLS)
    ]
    return torch.cat(shells).float()


def _radius(lower: Tensor, upper: Tensor) -> float:
    return 0.5 * float((upper - lower).norm())
