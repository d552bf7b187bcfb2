"""One frame of a track: the lights that its images and what was predicted of them make likely together.

With r the residual of N values, J its derivatives towards the unknowns u, d = u − u₀ their distance from the
prediction and C its covariance, the cost

    Σ r² / 2f²σ² + dᵀ C⁻¹ d / 2 ,     σ² = min_a Σ r² / N

(at the best intensities a, so that a lamp that is dimmed is no noise) is lowered by Levenberg-Marquardt (iterated
extended Kalman filter; Bell and Cathey 1993). f makes up for errors of the model, which neighbouring pixels share, so
that N values tell less than as many independent ones.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.fitting.certainty.doubts import doubts
from rgspipe.fitting.certainty.uncertainty import Covariances, light_covariances
from rgspipe.fitting.model.moments import Moments, scores
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.result import REASONS, FitResult, FitStatus
from rgspipe.fitting.search.refine import (
    ATTEMPTS,
    DAMPING,
    EASED,
    LONGEST_STEP,
    LONGEST_TURN,
    PLAIN,
    RAISED,
    SHORTEST_STEP,
    State,
    search_region,
    start_from,
    weights_at,
)
from rgspipe.fitting.search.starts import Rig
from rgspipe.fitting.selection.verdict import POORLY_EXPLAINED
from rgspipe.fitting.tracking.motion import Motion, offset, references, turns

#: Residuals below this part of the mean radiance are rounding.
LEAST_NOISE = 1e-6

#: A step that lowers the cost by less than this ends a fit: 1/2 is what one standard deviation costs.
LEAST_GAIN = 5e-3

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
    fit = _PriorFit(problem, predicted, inflation)
    damping = DAMPING
    for _ in range(iterations):
        gain, damping = fit.step(state, damping)
        if gain > 0.0:
            state.iterations += 1
            state.steps.append(state.record(problem, begin))
        if gain < LEAST_GAIN:
            state.status = FitStatus.CONVERGED
            break
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
class _PriorFit:
    problem: LightProblem
    predicted: Motion
    inflation: float

    def step(self, state: State, damping: float) -> tuple[float, float]:
        """One damped step that lowers the cost; by how much (0 if there is none), and new damping."""
        problem, region = self.problem, search_region(self.problem)
        system, variance = _system(problem, state)
        tempered = 1.0 / (variance * self.inflation**2)
        unknowns = _Unknowns.at(state.emitters, problem, self.predicted.reference)
        prior, pull = self._prior(state)
        matrix = tempered * unknowns.information(system, state.intensity) + prior
        direction = tempered * unknowns.direction(system, state.intensity) - pull
        cost = 0.5 * tempered * float(system.cost_at(state.intensity))
        cost += 0.5 * self._distance(state.emitters, state.intensity)
        weights = weights_at(problem, state, PLAIN, PLAIN.base(problem))
        for _ in range(ATTEMPTS):
            step = torch.linalg.solve(matrix + damping * torch.diag(matrix.diagonal()), direction)
            step = step * _allowed(step, state.emitters)
            emitters, intensity = self._moved(state, step)
            emitters = tuple(replace(one, position=region.clip(one.position)) for one in emitters)
            columns = [problem.evaluate(emitter) for emitter in emitters]
            state.evaluations += problem.renderings(emitters)
            trial = 0.5 * tempered * float(problem.moments(columns, weights).cost_at(intensity))
            trial += 0.5 * self._distance(emitters, intensity)
            if trial < cost:
                state.emitters, state.columns, state.intensity = emitters, columns, intensity
                return cost - trial, max(EASED * damping, 1e-6)
            if float(step.abs().max()) < SHORTEST_STEP:
                break
            damping *= RAISED
        return 0.0, damping

    def _offset(self, rig: Rig, intensity: Tensor) -> Tensor:
        """(D + 3L,) from the prediction."""
        before = self.predicted
        change = (self.problem.scale * intensity - before.intensity) / before.reference[:, None]
        return torch.cat([offset(before.rig, rig, before.size), change.flatten()])

    def _distance(self, rig: Rig, intensity: Tensor) -> float:
        """dᵀ C⁻¹ d."""
        away = self._offset(rig, intensity)
        return float(away @ self._precision @ away)

    def _prior(self, state: State) -> tuple[Tensor, Tensor]:
        """C⁻¹ and C⁻¹d in the parameters of `state`."""
        turned = turns(state.emitters, self.predicted.rig)
        basis = torch.block_diag(turned, torch.eye(self.predicted.unknowns - len(turned)).double())
        away = self._offset(state.emitters, state.intensity)
        return basis.T @ self._precision @ basis, basis.T @ (self._precision @ away)

    @property
    def _precision(self) -> Tensor:
        count = self.predicted.unknowns
        return torch.linalg.inv(self.predicted.covariance[:count, :count])

    def _moved(self, state: State, step: Tensor) -> tuple[Rig, Tensor]:
        sizes = [emitter.parameters for emitter in state.emitters]
        parts = step[: sum(sizes)].split(sizes)
        size = self.problem.views.frozen.size
        emitters = tuple(emitter.moved(part, size) for emitter, part in zip(state.emitters, parts, strict=True))
        colours = step[sum(sizes) :].reshape(-1, 3) * self.predicted.reference[:, None] / self.problem.scale
        return emitters, (state.intensity + colours).clamp(min=0.0)


def _allowed(step: Tensor, rig: Rig) -> float:
    """By which part of the step no light moves or turns too far."""
    share, first = 1.0, 0
    for emitter in rig:
        part = step[first : first + emitter.parameters]
        share = min(share, LONGEST_STEP / max(float(part[:3].norm()), 1e-300))
        if emitter.is_spot:
            share = min(share, LONGEST_TURN / max(float(part[3:].abs().max()), 1e-300))
        first += emitter.parameters
    return share


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
