"""Linear systems whose operator is symmetric and positive, by products with it alone (Hestenes and Stiefel 1952)."""

from __future__ import annotations

import math
from collections.abc import Callable

from torch import Tensor


def conjugate_gradients(
    operator: Callable[[Tensor], Tensor],
    right: Tensor,
    precondition: Callable[[Tensor], Tensor],
    steps: int,
) -> Tensor:
    """So many steps from 0 towards the solution x (M, C) of `operator` x = `right`, each column on its own.

    Args:
        precondition: about the operator's inverse, symmetric.
    """
    x, residual = right.new_zeros(right.shape), right
    z = precondition(residual)
    direction, energy = z, (residual * z).sum(dim=0)
    for _ in range(steps):
        image = operator(direction)
        step = energy / (direction * image).sum(dim=0).clamp(min=1e-30)
        x = x + step * direction
        residual = residual - step * image
        z = precondition(residual)
        renewed = (residual * z).sum(dim=0)
        direction = z + renewed / energy.clamp(min=1e-30) * direction
        energy = renewed
    return x


def steps_to(share: float, condition: float) -> int:
    """Steps after which no more than a `share` of the error is left, in the operator's norm.

    Args:
        condition: largest over least eigenvalue of the operator with its preconditioner (Saad 2003, equation 6.128).
    """
    root = math.sqrt(condition)
    return math.ceil(math.log(2.0 / share) / math.log((root + 1.0) / (root - 1.0))) if root > 1.0 else 1
