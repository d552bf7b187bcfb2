"""Derivatives of a light's image by central differences: the baseline that analytic ones are compared with."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter

#: Step of a parameter: of the scene's size for positions, rad for axes; see `Emitter`.
STEP = 1e-3


def central_differences(image: Callable[[Emitter], Tensor], emitter: Emitter, size: float) -> Tensor:
    """(P, 3, 1 + d) image of a unit light and its derivatives towards its natural parameters, from 1 + 2d images.

    Args:
        image: (P, 3) of an emitter.
        size: of the scene, scene units.
    """
    units = emitter.units(size)
    columns = [image(emitter)]
    for index in range(emitter.parameters):
        step = torch.zeros(emitter.parameters, dtype=torch.float64)
        step[index] = STEP
        ahead, behind = image(emitter.moved(step, size)), image(emitter.moved(-step, size))
        columns.append((ahead - behind) / (2.0 * STEP * float(units[index])))
    return torch.stack(columns, dim=2)
