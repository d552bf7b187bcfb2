"""One frame of a track: its lights, how they were found, how well they explain it, and in which order they stand."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import StrEnum

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment

from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search.schedule import soft
from rgspipe.scene import LightRig

#: Results with one answer.
SURE = (FitStatus.CONVERGED, FitStatus.MAX_ITERATIONS)

#: What a result tells of every light.
PER_LIGHT = ("lights", "covariance", "noise_covariance")


class FrameStatus(StrEnum):
    """How a frame's lights were found."""

    SEARCHED = "searched"
    TRACKED = "tracked"
    TRACED_BACK = "traced_back"
    REDETECTED = "redetected"
    UNCERTAIN = "uncertain"
    LOST = "lost"


@dataclass(frozen=True)
class TrackedFrame:
    """One frame of a track.

    Attributes:
        result: the fit; its lights have the same order in all frames. Its status is that of the frame's own images, its
            covariance that of these and of the frames from which it was followed.
        status: how they were found. UNCERTAIN where neither the frame's images nor the motion tell the positions, or
            where the track has no sure frame; LOST where nothing explains the frame.
        cost: median of the pixels' residuals over their brightness, 1 without lights.
        position_errors: per light the error that is to be expected, root mean square over the scene's size; of suns of
            the direction [rad].
    """

    result: FitResult
    status: FrameStatus
    cost: float
    position_errors: tuple[float, ...] = ()

    def sure(self, doubtful: float, faint: float) -> bool:
        """Whether the frame's own images tell all of its lights.

        Args:
            doubtful: errors of positions above this part of the scene's size are in doubt.
            faint: a light with less than this part of the strongest one's intensity explains nothing.
        """
        known = self.status not in (FrameStatus.LOST, FrameStatus.UNCERTAIN)
        told = self.result.status in SURE and max(self.position_errors, default=0.0) <= doubtful
        return known and told and not has_faint_light(self.result.lights, faint)


def has_faint_light(rig: LightRig, faint: float) -> bool:
    """Whether a light is so weak beside the strongest that it explains nothing."""
    strengths = [float(light.intensity.mean()) for light in rig]
    return bool(strengths) and min(strengths) < faint * max(strengths)


def frame_cost(problem: LightProblem, rig: LightRig) -> float:
    """Median over the pixels of the residual over the brightness, at the best intensities; 1 without lights."""
    if not rig or problem.black:
        return 1.0
    columns = [problem.evaluate(emitter) for emitter in soft(tuple(map(Emitter.of, rig)), 0.0)]
    weights = problem.relative_weights()
    intensity = problem.moments(columns, problem.unclipped(weights.square())).intensity
    # The weights' floor is part of the brightness, so a black image has a cost below 1 in dark pixels.
    return min(1.0, float((weights * problem.residual(columns, intensity)).abs().median()))


def in_order(result: FitResult, before: LightRig) -> FitResult:
    """The result with its lights, and all that is told of them, in the order of those that are nearest in `before`."""
    count = len(result.lights)
    if count < 2 or count != len(before):
        return result
    places = [torch.stack([light.position.double().cpu() for light in rig]).numpy() for rig in (before, result.lights)]
    apart = np.linalg.norm(places[0][:, None] - places[1][None], axis=-1)
    # Kinds stay apart: a spot is no point light's successor.
    kinds = np.array([[one.kind != other.kind for other in result.lights] for one in before])
    order = linear_sum_assignment(apart + kinds * (1.0 + apart.max()) * count)[1]
    told = {item.name: getattr(result, item.name) for item in fields(result) if item.name in PER_LIGHT}
    return replace(result, **{name: tuple(values[k] for k in order) for name, values in told.items() if values})
