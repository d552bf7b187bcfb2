"""Levenberg-Marquardt on all lights of a rig together, with the intensities in closed form."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.exposure import ExposedMoments
from rgspipe.fitting.model.moments import Moments
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.step_limits import StepLimits, allowed_share
from rgspipe.fitting.result import FitStatus, Step
from rgspipe.optim.levenberg_marquardt import Ended, NormalEquations, least_squares
from rgspipe.scene import LightRig

#: Residuals beyond this many medians lose their weight (Cauchy loss).
CAUCHY_MEDIANS = 3.0


@dataclass(frozen=True)
class Weighting:
    """How residuals count: relative to the pixel's brightness or linear, with a Cauchy loss or squared."""

    relative: bool
    robust: bool

    def base(self, problem: LightProblem) -> Tensor:
        """(P, 1) weights before the loss."""
        return problem.relative_weights() if self.relative else torch.ones_like(problem.target[:, :1])

    def squared(self, base: Tensor, residual: Tensor, scale: float) -> Tensor:
        """(P, 1) or (P, 3) squared weights of iteratively reweighted least squares."""
        if not self.robust:
            return base.square()
        return base.square() / (1.0 + (base * residual / scale).square())


#: The search forgives what the model gets wrong near edges and counts dim pixels; the polish uses plain squares, whose
#: bright pixels tell the most about the lights.
ROBUST, PLAIN = Weighting(relative=True, robust=True), Weighting(relative=False, robust=False)

#: What a descent's end is for a fit: where no step lowers the cost any more, a minimum is reached, to rounding.
STATUSES = {
    Ended.CONVERGED: FitStatus.CONVERGED,
    Ended.STALLED: FitStatus.CONVERGED,
    Ended.OUT_OF_STEPS: FitStatus.MAX_ITERATIONS,
}


@dataclass(frozen=True)
class Region:
    """Where lights may be.

    Attributes:
        lower, upper: (3,) float64 corners.
        size: the scene's, scene units.
    """

    lower: Tensor
    upper: Tensor
    size: float

    def clip(self, position: Tensor) -> Tensor:
        return torch.minimum(torch.maximum(position, self.lower), self.upper)

    def at_bound(self, position: Tensor) -> bool:
        near = 1e-6 * self.size
        return bool(((position - self.lower < near) | (self.upper - position < near)).any())


@dataclass
class State:
    """Where a refinement stands.

    Attributes:
        emitters: the L lights.
        columns: per light its image and derivatives, see `LightProblem.evaluate`.
        intensity: (L, 3) over the problem's scale.
    """

    emitters: tuple[Emitter, ...]
    columns: list[Tensor]
    intensity: Tensor
    steps: list[Step] = field(default_factory=list)
    evaluations: int = 0
    iterations: int = 0
    status: FitStatus = FitStatus.MAX_ITERATIONS

    def lights(self, problem: LightProblem) -> LightRig:
        return tuple(
            emitter.shining(problem.scale * strength)
            for emitter, strength in zip(self.emitters, self.intensity, strict=True)
        )

    def record(self, problem: LightProblem, begin: float) -> Step:
        """The present state as a step."""
        loss = problem.unexplained(self.columns, self.intensity)
        return Step(loss, self.lights(problem), time.perf_counter() - begin)


def search_region(problem: LightProblem) -> Region:
    """Where lights are looked for; see `renderer.surroundings`."""
    frozen = problem.views.frozen
    return Region(*frozen.surroundings.bounds, frozen.size)


def start_from(problem: LightProblem, emitters: Sequence[Emitter], weighting: Weighting, begin: float) -> State:
    """The state at `emitters`, with the intensities that belong to them."""
    columns = [problem.evaluate(emitter) for emitter in emitters]
    weights = problem.unclipped(weighting.base(problem).square())
    intensity = problem.moments(columns, weights).intensity
    state = State(tuple(emitters), columns, intensity, evaluations=problem.renderings(emitters))
    state.steps.append(state.record(problem, begin))
    return state


def fresh(state: State) -> State:
    """A copy that goes on from where `state` stands, with its steps, and counts its own work."""
    return replace(state, steps=[*state.steps], evaluations=0, iterations=0)


def reevaluate(problem: LightProblem, state: State) -> None:
    """Take the columns anew where the problem or the emitters' softness have changed."""
    state.columns = [problem.evaluate(emitter) for emitter in state.emitters]
    state.evaluations += problem.renderings(state.emitters)


def refine(
    problem: LightProblem, state: State, weighting: Weighting, iterations: int, region: Region, begin: float
) -> None:
    """Move `state` to a minimum of the weighted loss, by at most `iterations` accepted steps."""
    projected = _ProjectedRig(problem, weighting, weighting.base(problem), region, StepLimits())
    found = least_squares(projected, state, iterations, watch=lambda at: state.steps.append(at.record(problem, begin)))
    state.emitters, state.columns = found.value.emitters, found.value.columns
    state.iterations += found.iterations
    state.evaluations += found.evaluations * problem.renderings(state.emitters)
    state.status = STATUSES[found.ended]
    # The intensity that belongs to the last position under this weighting.
    state.intensity = projected.around(found.value).moments.intensity


def weights_at(problem: LightProblem, state: State, weighting: Weighting, base: Tensor) -> Tensor:
    """Squared weights of reweighted least squares at the present residual."""
    residual = problem.residual(state.columns, state.intensity)
    if problem.clip is None:
        return weighting.squared(base, residual, cauchy_scale(base * residual))
    # The active set of this step: a clipped value counts only where the image is darker than it.
    counted = ~problem.saturated | (residual > 0.0)
    scale = cauchy_scale((base * residual)[~problem.saturated])
    return weighting.squared(base, residual, scale) * counted


def cauchy_scale(weighted: Tensor) -> float:
    """The residual at which the Cauchy loss lets go: three medians, above rounding."""
    return CAUCHY_MEDIANS * float(weighted.abs().median()) + 1e-6 if weighted.numel() else 1.0


@dataclass(frozen=True)
class _ProjectedRig:
    """Lights whose intensities answer every step in closed form, as a problem of least squares."""

    problem: LightProblem
    weighting: Weighting
    base: Tensor
    region: Region
    limits: StepLimits

    def around(self, state: State) -> _AroundRig:
        weights = weights_at(self.problem, state, self.weighting, self.base)
        return _AroundRig(self, state, weights, self.problem.moments(state.columns, weights))


@dataclass(frozen=True)
class _AroundRig:
    """The problem around a state, with the weights that it gives the pixels."""

    whole: _ProjectedRig
    state: State
    weights: Tensor
    moments: Moments | ExposedMoments

    @cached_property
    def normal(self) -> NormalEquations:
        units = torch.cat([emitter.units(self.whole.region.size) for emitter in self.state.emitters])
        matrix, direction = self.moments.parameter_system()
        return NormalEquations(matrix * units[:, None] * units[None, :], direction * units, self.moments.cost)

    def allowed(self, step: Tensor) -> float:
        return allowed_share(self.state.emitters, step, self.whole.limits)

    def moved(self, step: Tensor) -> tuple[Emitter, ...]:
        return moved_rig(self.state.emitters, step, self.whole.region)

    def distance(self, rig: tuple[Emitter, ...]) -> float:
        return rig_move(self.state.emitters, rig, self.whole.region.size)

    def evaluated(self, rig: tuple[Emitter, ...]) -> tuple[float, State]:
        problem = self.whole.problem
        columns = [
            old if emitter is before else problem.evaluate(emitter)
            for emitter, before, old in zip(rig, self.state.emitters, self.state.columns, strict=True)
        ]
        moments = problem.moments(columns, self.weights)
        return moments.cost, replace(self.state, emitters=rig, columns=columns, intensity=moments.intensity)


def moved_rig(emitters: Sequence[Emitter], step: Tensor, region: Region) -> tuple[Emitter, ...]:
    """The lights after a step (D,); one that does not move is the same object."""
    parts = step.split([emitter.parameters for emitter in emitters])
    moved = []
    for emitter, part in zip(emitters, parts, strict=True):
        other = emitter.moved(part, region.size)
        other = other.placed(region.clip(other.position))
        moved.append(emitter if float(part.abs().max()) == 0.0 else other)
    return tuple(moved)


def rig_move(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> float:
    """The largest `Emitter.distance` of a light from itself."""
    return max(a.distance(b, size) for a, b in zip(one, other, strict=True))
