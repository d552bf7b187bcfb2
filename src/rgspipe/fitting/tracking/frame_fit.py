"""One frame of a track: the lights that its images and what was predicted of them make likely together.

With r the residual of N values, J its derivatives towards the unknowns u, d = u − u₀ their distance from the
prediction and C its covariance, the cost

    Σ r² / f²σ² + dᵀ C⁻¹ d ,     σ² = min_a Σ r² / N

(at the best intensities a, so that a lamp that is dimmed is no noise) is lowered by Levenberg-Marquardt (iterated
extended Kalman filter; Bell and Cathey 1993). f makes up for errors of the model, which neighbouring pixels share, so
that N values tell less than as many independent ones.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.certainty.doubts import doubts
from rgspipe.fitting.certainty.uncertainty import Covariances, light_covariances
from rgspipe.fitting.model.moments import Moments, scores
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.step_limits import StepLimits, allowed_share
from rgspipe.fitting.result import REASONS, FitResult, FitStatus
from rgspipe.fitting.search.refine import (
    PLAIN,
    STATUSES,
    Region,
    State,
    moved_rig,
    rig_move,
    search_region,
    start_from,
    weights_at,
)
from rgspipe.fitting.search.starts import Rig
from rgspipe.fitting.selection.verdict import POORLY_EXPLAINED
from rgspipe.fitting.tracking.motion import Motion, offset, references, turns
from rgspipe.optim.levenberg_marquardt import NormalEquations, least_squares

#: Residuals below this part of the mean radiance are rounding.
LEAST_NOISE = 1e-6

#: f stays in these bounds.
INFLATIONS = (1.0, 100.0)


@dataclass(frozen=True)
class Followed:
    """A frame's fit, what is known of the lights after it, and by which f errors of the model are larger than noise."""

    result: FitResult
    motion: Motion
    inflation: float


def observed(problem: LightProblem, rig: Rig, together: bool = False) -> Followed:
    """A frame whose lights are known already, by a search: with what its images alone tell of them."""
    begin = time.perf_counter()
    problem = _with_known_exposures(problem, rig, begin)
    state = start_from(problem, rig, PLAIN, begin)
    spread = light_covariances(problem, state)
    inflation = inflation_of(spread)
    system, variance = _system(problem, state)
    intensity = problem.scale * state.intensity
    information = _Unknowns.at(state.emitters, problem, references(intensity)).information(system, state.intensity)
    size = problem.views.frozen.size
    motion = Motion.starting(state.emitters, intensity, information / (variance * inflation**2), size, together)
    return Followed(_result(problem, state, motion, spread, begin), motion, inflation)


def follow(problem: LightProblem, predicted: Motion, inflation: float, iterations: int) -> Followed:
    """The frame's lights, started from where they are predicted, by at most `iterations` steps."""
    begin = time.perf_counter()
    problem = _with_known_exposures(problem, predicted.rig, begin)
    state = start_from(problem, predicted.rig, PLAIN, begin)
    state.intensity = predicted.intensity / problem.scale
    expected = _PredictedRig(problem, predicted, inflation, search_region(problem), StepLimits())
    found = least_squares(expected, state, iterations, watch=lambda at: state.steps.append(at.record(problem, begin)))
    state = replace(
        found.value,
        iterations=found.iterations,
        evaluations=state.evaluations + found.evaluations * problem.renderings(state.emitters),
        status=STATUSES[found.ended],
    )
    system, variance = _system(problem, state)
    unknowns = _Unknowns.at(state.emitters, problem, predicted.reference)
    information = unknowns.information(system, state.intensity) / (variance * inflation**2)
    motion = predicted.updated(state.emitters, problem.scale * state.intensity, information)
    spread = light_covariances(problem, state)
    return Followed(_result(problem, state, motion, spread, begin), motion, inflation_of(spread))


def inflation_of(spread: Covariances) -> float:
    """f: by how much the deviations of positions are larger than noise alone would have them."""
    pairs = zip(spread.calibrated, spread.noise, strict=True)
    logs = torch.cat([0.5 * (one.diagonal()[:3] / other.diagonal()[:3]).log() for one, other in pairs])
    logs = logs[torch.isfinite(logs)]
    factor = float(logs.mean().exp()) if len(logs) else INFLATIONS[1]
    return min(max(factor, INFLATIONS[0]), INFLATIONS[1])


@dataclass(frozen=True)
class _Unknowns:
    """Units of the unknowns in a frame's moments: parameters in natural units, intensities over the frame's scale."""

    units: Tensor

    @classmethod
    def at(cls, rig: Rig, problem: LightProblem, reference: Tensor) -> _Unknowns:
        size = problem.views.frozen.size
        colours = (reference / problem.scale).repeat_interleave(3)
        return cls(torch.cat([*(emitter.units(size) for emitter in rig), colours]))

    def information(self, system: Moments, intensity: Tensor) -> Tensor:
        """(D + 3L,) * 2 JᵀJ."""
        return system.information(intensity) * self.units[:, None] * self.units[None, :]

    def direction(self, system: Moments, intensity: Tensor) -> Tensor:
        """(D + 3L,) Jᵀr."""
        count = system.lights
        images = torch.einsum("ckl,lc->ck", system.values[:, :, :count], intensity)
        residual = system.values.clone()
        residual[:, :, -1] -= images
        return scores(residual, system.owners, intensity) * self.units


@dataclass(frozen=True)
class _PredictedRig:
    """A frame's lights, parameters and intensities together, as a problem of least squares."""

    problem: LightProblem
    predicted: Motion
    inflation: float
    region: Region
    limits: StepLimits

    def around(self, state: State) -> _AroundPrediction:
        system, variance = _system(self.problem, state)
        weights = weights_at(self.problem, state, PLAIN, PLAIN.base(self.problem))
        return _AroundPrediction(self, state, weights, system, 1.0 / (variance * self.inflation**2))

    @cached_property
    def precision(self) -> Tensor:
        """C⁻¹."""
        count = self.predicted.unknowns
        return torch.linalg.inv(self.predicted.covariance[:count, :count])

    def offset(self, rig: Rig, intensity: Tensor) -> Tensor:
        """(D + 3L,) d, from the prediction."""
        before = self.predicted
        change = (self.problem.scale * intensity - before.intensity) / before.reference[:, None]
        return torch.cat([offset(before.rig, rig, before.size), change.flatten()])

    def cost(self, system: Moments, tempered: float, rig: Rig, intensity: Tensor) -> float:
        away = self.offset(rig, intensity)
        return tempered * float(system.cost_at(intensity)) + float(away @ self.precision @ away)


@dataclass(frozen=True)
class _AroundPrediction:
    """The problem around a state, with `tempered` = 1 / f²σ² there."""

    whole: _PredictedRig
    state: State
    weights: Tensor
    system: Moments
    tempered: float

    @cached_property
    def normal(self) -> NormalEquations:
        whole, state = self.whole, self.state
        unknowns = _Unknowns.at(state.emitters, whole.problem, whole.predicted.reference)
        turned = turns(state.emitters, whole.predicted.rig)
        basis = torch.block_diag(turned, torch.eye(whole.predicted.unknowns - len(turned)).double())
        pull = basis.T @ (whole.precision @ whole.offset(state.emitters, state.intensity))
        matrix = self.tempered * unknowns.information(self.system, state.intensity)
        direction = self.tempered * unknowns.direction(self.system, state.intensity) - pull
        cost = whole.cost(self.system, self.tempered, state.emitters, state.intensity)
        return NormalEquations(matrix + basis.T @ whole.precision @ basis, direction, cost)

    def allowed(self, step: Tensor) -> float:
        return allowed_share(self.state.emitters, step[: self._parameters], self.whole.limits)

    def moved(self, step: Tensor) -> tuple[Rig, Tensor]:
        whole, count = self.whole, self._parameters
        colours = step[count:].reshape(-1, 3) * whole.predicted.reference[:, None] / whole.problem.scale
        rig = moved_rig(self.state.emitters, step[:count], whole.region)
        return rig, (self.state.intensity + colours).clamp(min=0.0)

    def distance(self, place: tuple[Rig, Tensor]) -> float:
        whole, (rig, intensity) = self.whole, place
        brightened = whole.problem.scale * (intensity - self.state.intensity) / whole.predicted.reference[:, None]
        return max(rig_move(self.state.emitters, rig, whole.region.size), float(brightened.abs().max()))

    def evaluated(self, place: tuple[Rig, Tensor]) -> tuple[float, State]:
        whole, (rig, intensity) = self.whole, place
        columns = [whole.problem.evaluate(emitter) for emitter in rig]
        system = whole.problem.moments(columns, self.weights)
        cost = whole.cost(system, self.tempered, rig, intensity)
        return cost, replace(self.state, emitters=rig, columns=columns, intensity=intensity)

    @property
    def _parameters(self) -> int:
        return sum(emitter.parameters for emitter in self.state.emitters)


def _system(problem: LightProblem, state: State) -> tuple[Moments, float]:
    """The frame's moments, and σ²."""
    weights = weights_at(problem, state, PLAIN, PLAIN.base(problem))
    system = problem.moments(state.columns, weights)
    counted = max(1.0, float(weights.double().expand(problem.target.shape).sum()))
    return system, max(LEAST_NOISE**2, system.cost / counted)


def _with_known_exposures(problem: LightProblem, rig: Rig, begin: float) -> LightProblem:
    """The problem with those exposures that explain the images best with the lights of `rig`."""
    if not problem.exposure_free:
        return problem
    state = start_from(problem, rig, PLAIN, begin)
    weights = weights_at(problem, state, PLAIN, PLAIN.base(problem))
    return replace(problem.with_exposures(problem.moments(state.columns, weights).exposures), exposure_free=False)


def _result(problem: LightProblem, state: State, motion: Motion, spread: Covariances, begin: float) -> FitResult:
    """The fit of a frame; its status is that of the frame's images alone, its covariance that of all frames so far."""
    loss, lights = problem.unexplained(state.columns, state.intensity), state.lights(problem)
    region = search_region(problem)
    doubt = doubts(lights, spread.calibrated, problem.views.frozen.surfels, region.size)
    status = state.status
    if any(region.at_bound(emitter.position) for emitter in state.emitters):
        status = FitStatus.AT_BOUND
    elif loss > POORLY_EXPLAINED:
        status = FitStatus.UNEXPLAINED
    elif doubt:
        status = FitStatus.UNDETERMINED
    return FitResult(
        lights=lights,
        status=status,
        reason=" ".join(filter(None, (REASONS[status], doubt))),
        loss=loss,
        iterations=state.iterations,
        evaluations=state.evaluations,
        lights_tried=len(lights),
        seconds=time.perf_counter() - begin,
        covariance=motion.light_covariances(),
        trajectory=tuple(state.steps),
        exposures=tuple(problem.exposures.tolist()),
        noise_covariance=spread.noise,
    )
