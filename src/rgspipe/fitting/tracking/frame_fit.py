"""One frame of a track: the lights that its images and what was predicted of them make likely together.

With r the residual of N values, J its derivatives towards the unknowns u, d = u − u₀ their distance from the
prediction and C its covariance, the cost

    Σ r² / f²σ² + dᵀ C⁻¹ d ,     σ² = min_a Σ r² / N

(at the best intensities a, so that a lamp that is dimmed is no noise) is lowered by Levenberg-Marquardt (iterated
extended Kalman filter; Bell and Cathey 1993). f makes up for errors of the model, which neighbouring pixels share, so
that N values tell less than as many independent ones, and no less than one: 1 ≤ f² ≤ N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import torch

from rgspipe.fitting.certainty.uncertainty import Covariances, light_covariances
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import CertaintyOptions, TrackOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import EmitterRig
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.diagnosis import standing
from rgspipe.fitting.tracking.motion import Motion, references
from rgspipe.fitting.tracking.predicted_rig import Evidence, PredictedRig


@dataclass(frozen=True)
class Followed:
    """A frame's fit, what is known of the lights after it, and by which f errors of the model are larger than noise."""

    result: FitResult
    motion: Motion
    inflation: float


def observed(
    problem: LightProblem,
    rig: EmitterRig,
    options: TrackOptions | None = None,
    certainty: CertaintyOptions | None = None,
) -> Followed:
    """A frame whose lights are known already, by a search: with what its images alone tell of them."""
    options = options or TrackOptions()
    refiner = _refiner(problem, rig)
    problem, state = refiner.problem, refiner.start(rig, PLAIN)
    spread = light_covariances(problem, state, certainty, displaced=False)
    inflation = inflation_of(spread, problem.target.numel())
    intensity = problem.scale * state.intensity
    evidence = Evidence.of(problem, state, references(intensity))
    information = evidence.information() / (evidence.variance * inflation**2)
    size, together = problem.views.frozen.size, options.together
    motion = Motion.starting(state.emitters, intensity, information, size, together, options.motion)
    return Followed(_result(refiner, state, motion, spread, certainty), motion, inflation)


def follow(
    problem: LightProblem,
    predicted: Motion,
    inflation: float,
    iterations: int,
    certainty: CertaintyOptions | None = None,
) -> Followed:
    """The frame's lights, started from where they are predicted, by at most `iterations` steps."""
    refiner = _refiner(problem, predicted.rig)
    problem, start = refiner.problem, refiner.start(predicted.rig, PLAIN)
    start = replace(start, intensity=predicted.intensity / problem.scale)
    state = refiner.descended(PredictedRig(refiner, predicted, inflation), start, iterations)
    evidence = Evidence.of(problem, state, predicted.reference)
    information = evidence.information() / (evidence.variance * inflation**2)
    motion = predicted.updated(state.emitters, problem.scale * state.intensity, information)
    spread = light_covariances(problem, state, certainty, displaced=False)
    return Followed(
        _result(refiner, state, motion, spread, certainty), motion, inflation_of(spread, problem.target.numel())
    )


def inflation_of(spread: Covariances, values: int) -> float:
    """f: by how much the deviations of positions are larger than noise alone in N `values` would have them."""
    pairs = zip(spread.calibrated, spread.noise, strict=True)
    logs = torch.cat([0.5 * (one.diagonal()[:3] / other.diagonal()[:3]).log() for one, other in pairs])
    logs = logs[torch.isfinite(logs)]
    factor = float(logs.mean().exp()) if len(logs) else math.inf
    return min(max(factor, 1.0), math.sqrt(values))


def _refiner(problem: LightProblem, rig: EmitterRig) -> Refiner:
    """For the problem with those exposures that explain the images best with the lights of `rig`."""
    refiner = Refiner.of(problem)
    if not problem.exposure_free:
        return refiner
    state = refiner.start(rig, PLAIN)
    exposures = problem.moments(state.columns, refiner.weights(state, PLAIN)).exposures
    return refiner.on(replace(problem.with_exposures(exposures), exposure_free=False))


def _result(
    refiner: Refiner, state: State, motion: Motion, spread: Covariances, certainty: CertaintyOptions | None
) -> FitResult:
    """The fit of a frame; its status is that of the frame's images alone, its covariance that of all frames so far."""
    problem, meter = refiner.problem, refiner.meter
    loss, lights = refiner.unexplained(state), state.lights(problem)
    return FitResult(
        lights=lights,
        findings=tuple(standing(refiner, state, spread.calibrated, certainty)),
        loss=loss,
        iterations=meter.iterations,
        evaluations=meter.evaluations,
        lights_tried=len(lights),
        seconds=meter.seconds,
        covariance=motion.light_covariances(),
        trajectory=state.steps,
        exposures=tuple(problem.exposures.tolist()),
        noise_covariance=spread.noise,
    )
