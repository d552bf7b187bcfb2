"""Adam's direction for parameters of very different numbers of observations."""

from __future__ import annotations

from torch import Tensor

from rgspipe.machine.sums import average

#: Decay of the first and the second moment.
FAST, SLOW = 0.9, 0.98


def adam_direction(first: Tensor, second: Tensor, gradient: Tensor, step: int) -> Tensor:
    """Adam's direction (Kingma & Ba 2015), with a floor on the second moment that scales with the gradients.

    A fixed floor would freeze scenes whose images are dim; none would let surfels that were grazed once
    by a single ray step as far as those that every image shows.

    Args:
        first, second: moments, updated in place.
        step: this step's number, from 1.
    """
    first.mul_(FAST).add_(gradient, alpha=1.0 - FAST)
    second.mul_(SLOW).addcmul_(gradient, gradient, value=1.0 - SLOW)
    mean = first / (1.0 - FAST**step)
    spread = (second / (1.0 - SLOW**step)).sqrt()
    floor = 1e-3 * average(spread.square()).sqrt() + 1e-20
    return mean / (spread + floor)
