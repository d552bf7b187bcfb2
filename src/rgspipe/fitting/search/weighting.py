"""How much each pixel counts in a refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.problem import ROUNDING, LightProblem


@dataclass(frozen=True)
class Weighting:
    """How residuals count: relative to the pixel's brightness or linear, with a Cauchy loss or squared."""

    relative: bool
    robust: bool

    def base(self, problem: LightProblem) -> Tensor:
        """(P, 1) weights before the loss."""
        relative = self.relative or problem.loss.polish == "relative"
        return problem.relative_weights() if relative else torch.ones_like(problem.target[:, :1])

    def squared(self, base: Tensor, residual: Tensor, scale: float) -> Tensor:
        """(P, 1) or (P, 3) squared weights of iteratively reweighted least squares."""
        if not self.robust:
            return base.square()
        return base.square() / (1.0 + (base * residual / scale).square())

    def at(self, problem: LightProblem, columns: Sequence[Tensor], intensity: Tensor) -> Tensor:
        """(P, 1) or (P, 3) squared weights at the residual that lights leave.

        Args:
            columns: per light its image, see `LightProblem.evaluate`.
            intensity: (L, 3) over the problem's scale.
        """
        base, residual = self.base(problem), problem.residual(columns, intensity)
        if problem.clip is None:
            return self.squared(base, residual, cauchy_scale(problem, base * residual))
        # The active set of this step: a clipped value counts only where the image is darker than it.
        counted = ~problem.saturated | (residual > 0.0)
        scale = cauchy_scale(problem, (base * residual)[~problem.saturated])
        return self.squared(base, residual, scale) * counted


#: The search forgives what the model gets wrong near edges and counts dim pixels; the polish uses plain squares, whose
#: bright pixels tell the most about the lights, unless `LossOptions.polish` says that errors grow with brightness.
ROBUST, PLAIN = Weighting(relative=True, robust=True), Weighting(relative=False, robust=False)


def cauchy_scale(problem: LightProblem, weighted: Tensor) -> float:
    """The residual at which the Cauchy loss lets go: some medians, above rounding."""
    return problem.loss.medians * float(weighted.abs().median()) + ROUNDING if weighted.numel() else 1.0
