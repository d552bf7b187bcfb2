"""What a fit returns: the lights, why it stopped and what to do about it, and how it got there."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from torch import Tensor

from rgspipe.scene import LightRig


class FitStatus(StrEnum):
    """Why a fit ended."""

    CONVERGED = "converged"
    MAX_ITERATIONS = "max_iterations"
    AT_BOUND = "at_bound"
    NOT_ENOUGH_LIGHT = "not_enough_light"


#: For each status one sentence that says what it means and what to do.
REASONS = {
    FitStatus.CONVERGED: "The loss has a minimum here: a further step would not change the light.",
    FitStatus.MAX_ITERATIONS: "All iterations were used while the loss was still falling: allow more of them.",
    FitStatus.AT_BOUND: "The light was stopped at the edge of the region that is searched: the true light may be "
    "outside, or these views do not tell its distance; give more views or a larger region.",
    FitStatus.NOT_ENOUGH_LIGHT: "The target is black, or no light in the scene can explain it: check its exposure, "
    "its mask and that it shows this scene.",
}


@dataclass(frozen=True)
class Step:
    """A fit's state after one of its steps.

    Attributes:
        loss: the method's own loss.
        position: (3,) float64, scene units.
        intensity: (3,) float64, W/sr.
        seconds: since the fit began.
    """

    loss: float
    position: Tensor
    intensity: Tensor
    seconds: float


@dataclass(frozen=True)
class FitResult:
    """Recovered lights.

    Attributes:
        lights: the rig; empty if there was not enough light.
        status: why the fit ended.
        reason: the status in words, with what to do.
        loss: the method's final loss.
        iterations: accepted steps, over all starts.
        evaluations: renderings of the scene, over all starts.
        lights_tried: the largest number of lights that was considered.
        seconds: duration.
        covariance: per light (6, 6) float64 of (x, y, z, r, g, b): Gauss-Newton, with the residual as
            independent noise of the pixels. Model errors are shared by neighbouring pixels, so it is too
            small (by 6 to 12 times in standard deviation on trained scenes); its calibration is not done.
        trajectory: the steps from the start that won to the end, the start included.
    """

    lights: LightRig
    status: FitStatus
    reason: str
    loss: float
    iterations: int
    evaluations: int
    lights_tried: int
    seconds: float
    covariance: tuple[Tensor, ...]
    trajectory: tuple[Step, ...]


def dark_result(seconds: float) -> FitResult:
    """The result for a target that no light explains."""
    status = FitStatus.NOT_ENOUGH_LIGHT
    return FitResult((), status, REASONS[status], 0.0, 0, 0, 1, seconds, (), ())
