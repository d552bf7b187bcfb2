"""Levenberg-Marquardt on all lights of a rig together, with the intensities in closed form."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from rgspipe.fitting.model.moments import Moments
from rgspipe.fitting.model.parameters import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.result import FitStatus, Step
from rgspipe.scene import LightRig

#: A step moves no position by more than this part of the scene's size, and turns no axis and changes no cone by more
#: than `LONGEST_TURN` (rad; of a cone, of its transformed parameter).
LONGEST_STEP, LONGEST_TURN = 0.12, 0.3

#: A step below this part of the scene's size, and this angle, ends a refinement if it lowered the cost by less than
#: this share: where next to nothing is left unexplained, short steps still gain.
SHORTEST_STEP, SMALL_GAIN = 1e-4, 0.05

#: A step that moves by less than this is none.
SHORTEST_MOVE = 2e-7

#: A step that is expected to lower the cost by less than this share of it ends a refinement, too.
LEAST_GAIN = 1e-5

#: Damping: at first, when a step succeeds, when it fails; and how often it may fail in a row.
DAMPING, EASED, RAISED, ATTEMPTS = 1e-2, 0.2, 6.0, 5

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
            emitter.light(problem.scale * strength)
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
    base, damping = weighting.base(problem), DAMPING
    state.status = FitStatus.MAX_ITERATIONS
    for _ in range(iterations):
        weights = weights_at(problem, state, weighting, base)
        system = problem.moments(state.columns, weights)
        moved, gained, damping = _attempt(problem, state, system, weights, damping, region)
        if moved == 0.0:
            state.status = FitStatus.CONVERGED
            break
        state.iterations += 1
        state.steps.append(state.record(problem, begin))
        if moved < SHORTEST_STEP and gained < SMALL_GAIN:
            state.status = FitStatus.CONVERGED
            break
    # The intensity that belongs to the last position under this weighting.
    weights = weights_at(problem, state, weighting, base)
    state.intensity = problem.moments(state.columns, weights).intensity


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


def _attempt(
    problem: LightProblem, state: State, system: Moments, weights: Tensor, damping: float, region: Region
) -> tuple[float, float, float]:
    """Take one damped step that lowers the weighted cost.

    Returns:
        How far it moved (0 if there is none), by what share it lowered the cost, and new damping.
    """
    units = torch.cat([emitter.units(region.size) for emitter in state.emitters])
    matrix, direction = system.parameter_system()
    matrix, direction = matrix * units[:, None] * units[None, :], direction * units
    cost = system.cost
    for _ in range(ATTEMPTS):
        step = _damped_step(matrix, direction, damping, state.emitters)
        if float(2.0 * step @ direction - step @ matrix @ step) < LEAST_GAIN * cost:
            break
        emitters = _moved(state.emitters, step, region)
        moved = max(emitter_distance(a, b, region.size) for a, b in zip(emitters, state.emitters, strict=True))
        if moved < SHORTEST_MOVE:
            break
        columns = [
            old if emitter is before else problem.evaluate(emitter)
            for emitter, before, old in zip(emitters, state.emitters, state.columns, strict=True)
        ]
        state.evaluations += problem.renderings(emitters)
        trial = problem.moments(columns, weights)
        if trial.cost < cost:
            state.emitters, state.columns, state.intensity = emitters, columns, trial.intensity
            return moved, 1.0 - trial.cost / cost, max(EASED * damping, 1e-6)
        if moved < SHORTEST_STEP:
            break
        damping *= RAISED
    return 0.0, 0.0, damping


def _damped_step(matrix: Tensor, direction: Tensor, damping: float, emitters: Sequence[Emitter]) -> Tensor:
    """(D,) Levenberg-Marquardt step, no longer than allowed; zero where nothing is determined."""
    trace = float(matrix.trace())
    if not trace > 0.0:
        return torch.zeros(len(matrix), dtype=torch.float64)
    damped = matrix + damping * torch.diag(matrix.diagonal()) + 1e-9 * trace * torch.eye(len(matrix)).double()
    step = torch.linalg.solve(damped, direction)
    share = 1.0
    for part in step.split([emitter.parameters for emitter in emitters]):
        share = min(share, LONGEST_STEP / max(float(part[:3].norm()), 1e-300))
        if len(part) > 3:
            share = min(share, LONGEST_TURN / max(float(part[3:].abs().max()), 1e-300))
    return step * share


def _moved(emitters: Sequence[Emitter], step: Tensor, region: Region) -> tuple[Emitter, ...]:
    """The lights after a step; one that does not move is the same object."""
    parts = step.split([emitter.parameters for emitter in emitters])
    moved = []
    for emitter, part in zip(emitters, parts, strict=True):
        other = emitter.moved(part, region.size)
        other = replace(other, position=region.clip(other.position))
        moved.append(emitter if float(part.abs().max()) == 0.0 else other)
    return tuple(moved)


def emitter_distance(one: Emitter, other: Emitter, size: float) -> float:
    """The largest of the move over the scene's size, the turn of the axis and the change of the cone [rad]."""
    # A scene of one surfel has no size, and no room to move in.
    moved = float((one.position - other.position).norm()) / size if size > 0.0 else 0.0
    if not one.is_spot:
        return moved
    turned = float((one.axis - other.axis).norm())
    changed = abs(one.shape.cone_angle - other.shape.cone_angle)
    if one.shape.profile == "gaussian":
        changed = max(changed, abs(one.shape.falloff - other.shape.falloff))
    return max(moved, turned, changed)
