"""Time and memory of one step of a fit with a model: image, loss and gradient towards the light's position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.benchmark.settings import Model
from rgspipe.evaluation.timing import median_ms
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.machine.description import peak_memory_now_mib, reset_peak_memory
from rgspipe.scene import PointLight


@dataclass(frozen=True)
class StepCost:
    """Medians over several runs of one view.

    Attributes:
        forward_ms: image of a light.
        step_ms: image, squared error and its gradient towards the light's position.
        peak_mib: resident memory at its highest meanwhile, the model included; NaN where the system does not tell.
    """

    forward_ms: float
    step_ms: float
    peak_mib: float

    @property
    def backward_ms(self) -> float:
        """What the gradient adds."""
        return max(0.0, self.step_ms - self.forward_ms)


def step_cost(model: Model, position: Tensor, repetitions: int) -> StepCost:
    """The cost of a step with the model's first view."""
    step = _step_by_columns(model) if model.at_pixels else _step_by_autograd(model)
    reset_peak_memory()
    forward = median_ms(lambda: model.image(0, (PointLight(position.float(), torch.ones(3)),)), repetitions)
    both = median_ms(lambda: step(position), repetitions)
    return StepCost(forward, both, peak_memory_now_mib())


def _step_by_autograd(model: Model) -> Callable[[Tensor], Tensor]:
    def step(position: Tensor) -> Tensor:
        leaf = position.float().clone().requires_grad_()
        image = model.image(0, (PointLight(leaf, torch.ones(3)),))
        image.square().mean().backward()
        return leaf.grad

    return step


def _step_by_columns(model: Model) -> Callable[[Tensor], Tensor]:
    def step(position: Tensor) -> Tensor:
        columns = model.seen[0].columns(Emitter(PointLight(position, 1.0)))
        return torch.einsum("pc,pcx->x", columns[:, :, 0], columns[:, :, 1:]) * (2.0 / columns[:, :, 0].numel())

    return step
