"""Derivatives of a light's image by central differences: the baseline that analytic ones are compared with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.images.model import ImageModel
from rgspipe.renderer.sparse import SparseOperator

#: Step of a parameter: of the scene's size for positions, rad for axes; see `Emitter`.
STEP = 1e-3


@dataclass(frozen=True)
class DifferenceModel(ImageModel):
    """A model of images with derivatives by central differences in the place of its own.

    Attributes:
        exact: the model.
        size: of the scene, scene units.
    """

    exact: ImageModel
    size: float

    @property
    def effects(self) -> Effects:
        return self.exact.effects

    @property
    def view_of(self) -> Tensor:
        return self.exact.view_of

    @property
    def bounds(self) -> list[int]:
        return self.exact.bounds

    @property
    def counts(self) -> Tensor:
        return self.exact.counts

    @property
    def average(self) -> SparseOperator | None:
        return self.exact.average

    def columns(self, light: Emitter) -> Tensor:
        return central_differences(lambda other: self.exact.columns(other)[:, :, 0], light, self.size)

    def renderings(self, light: Emitter) -> int:
        return 1 + 2 * light.parameters


def by_differences(problem: LightProblem) -> LightProblem:
    """The same problem with derivatives by central differences."""
    size = problem.views.frozen.size
    sharp = None if problem.sharp is None else DifferenceModel(problem.sharp, size)
    return replace(problem, model=DifferenceModel(problem.model, size), sharp=sharp)


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
