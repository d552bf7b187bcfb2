"""`fit=search_lm`: candidates from a dictionary, then Levenberg-Marquardt with the intensity in closed form."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import torch
from torch import Tensor

from rgspipe.fitting.coarse import CoarseImages, best_candidates, candidate_costs
from rgspipe.fitting.moments import Moments, covariance
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.result import REASONS, FitResult, FitStatus, Step, dark_result
from rgspipe.scene import PointLight

#: Starts stand this far apart, as a part of the scene's size.
SEPARATION = 0.16

#: Steps of each start before the best one is chosen.
SHORT_ITERATIONS = 6

#: A step is at most this part of the scene's size.
LONGEST_STEP = 0.12

#: A step below this part of the scene's size ends a refinement.
SHORTEST_STEP = 2e-5

#: How far outside the bounding box a light may go, in parts of the scene's size.
MARGIN = 0.25

#: Damping: at first, when a step succeeds, when it fails; and how often it may fail in a row.
DAMPING, EASED, RAISED, ATTEMPTS = 1e-2, 0.2, 6.0, 5

#: Residuals beyond this many medians lose their weight (Cauchy loss).
CAUCHY_MEDIANS = 3.0


@dataclass(frozen=True)
class SearchOptions:
    """How `search_lm` searches.

    Attributes:
        starts: best candidates that are refined.
        iterations: most Levenberg-Marquardt steps of the final refinement.
    """

    starts: int = 4
    iterations: int = 30


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


@dataclass
class _State:
    """Where a refinement stands."""

    position: Tensor
    columns: Tensor
    intensity: Tensor
    steps: list[Step] = field(default_factory=list)
    evaluations: int = 0
    iterations: int = 0
    status: FitStatus = FitStatus.MAX_ITERATIONS


@dataclass(frozen=True)
class _Region:
    lower: Tensor
    upper: Tensor
    size: float

    def clip(self, position: Tensor) -> Tensor:
        return torch.minimum(torch.maximum(position, self.lower), self.upper)

    def at_bound(self, position: Tensor) -> bool:
        near = 1e-6 * self.size
        return bool(((position - self.lower < near) | (self.upper - position < near)).any())


def search_region(problem: LightProblem) -> _Region:
    """The scene's bounding box and a margin around it."""
    frozen = problem.views.frozen
    lower, upper = (corner.double().cpu() for corner in frozen.bounds)
    return _Region(lower - MARGIN * frozen.size, upper + MARGIN * frozen.size, frozen.size)


def fit_search_lm(problem: LightProblem, coarse: CoarseImages, options: SearchOptions) -> FitResult:
    """One point light: refine the candidates that look most like the target, polish the best.

    The search uses relative weights and a Cauchy loss, which forgive what the model gets wrong near edges and
    count dim pixels; the polish uses plain squares, whose bright pixels tell the most about the light.
    """
    begin = time.perf_counter()
    costs, intensities = candidate_costs(problem, coarse) if not problem.black else (torch.zeros(0), torch.zeros(0, 3))
    lit = intensities.sum(dim=1) > 0
    costs = torch.where(lit, costs, torch.inf)
    if not bool(lit.any()):
        return dark_result(time.perf_counter() - begin)
    region = search_region(problem)
    count = min(options.starts, int(lit.sum()))
    chosen = best_candidates(costs, coarse.positions.cpu(), count, SEPARATION * region.size)
    robust = Weighting(relative=True, robust=True)
    starts = [_start(problem, coarse.positions[index].double().cpu(), robust, begin) for index in chosen]
    for state in starts:
        refine(problem, state, robust, min(SHORT_ITERATIONS, options.iterations), region, begin)
    best = _best(problem, starts, robust)
    if problem.views.pixel_direct:
        problem = problem.sharpest()
        best.columns = problem.evaluate(best.position)
        best.evaluations += 1
    refine(problem, best, Weighting(relative=False, robust=False), options.iterations, region, begin)
    if not bool((best.intensity > 0).any()):
        return dark_result(time.perf_counter() - begin)
    return _result(problem, best, starts, region, begin)


def fit_from(problem: LightProblem, start: Tensor, iterations: int = 30) -> FitResult:
    """One point light from a known start (3,), by plain least squares: no search, no robust loss."""
    begin = time.perf_counter()
    if problem.black:
        return dark_result(0.0)
    problem = problem.sharpest()
    region, plain = search_region(problem), Weighting(relative=False, robust=False)
    state = _start(problem, start.double().cpu(), plain, begin)
    refine(problem, state, plain, iterations, region, begin)
    return _result(problem, state, [state], region, begin)


def refine(
    problem: LightProblem, state: _State, weighting: Weighting, iterations: int, region: _Region, begin: float
) -> None:
    """Move `state` to a minimum of the weighted loss, by at most `iterations` accepted steps."""
    base, damping = weighting.base(problem), DAMPING
    state.status = FitStatus.MAX_ITERATIONS
    for _ in range(iterations):
        residual = problem.residual(state.columns, state.intensity)
        weights = weighting.squared(base, residual, cauchy_scale(base * residual))
        system = problem.moments(state.columns, weights)
        moved, damping = _attempt(problem, state, system, weights, damping, region)
        if moved == 0.0:
            state.status = FitStatus.CONVERGED
            break
        state.iterations += 1
        state.steps.append(_step(problem, state, begin))
        if moved < SHORTEST_STEP * region.size:
            state.status = FitStatus.CONVERGED
            break
    # The intensity that belongs to the last position under this weighting.
    residual = problem.residual(state.columns, state.intensity)
    weights = weighting.squared(base, residual, cauchy_scale(base * residual))
    state.intensity = problem.moments(state.columns, weights).intensity


def _attempt(
    problem: LightProblem, state: _State, system: Moments, weights: Tensor, damping: float, region: _Region
) -> tuple[float, float]:
    """Take one damped step that lowers the weighted cost; the length moved (0 if there is none) and new damping."""
    matrix, direction = system.position_system()
    cost = system.cost
    for _ in range(ATTEMPTS):
        position = region.clip(state.position + _damped_step(matrix, direction, damping, LONGEST_STEP * region.size))
        moved = float((position - state.position).norm())
        if moved < 0.01 * SHORTEST_STEP * region.size:
            break
        columns = problem.evaluate(position)
        state.evaluations += 1
        trial = problem.moments(columns, weights)
        if trial.cost < cost:
            state.position, state.columns, state.intensity = position, columns, trial.intensity
            return moved, max(EASED * damping, 1e-6)
        damping *= RAISED
    return 0.0, damping


def _damped_step(matrix: Tensor, direction: Tensor, damping: float, longest: float) -> Tensor:
    """(3,) Levenberg-Marquardt step, no longer than `longest`; zero where nothing is determined."""
    trace = float(matrix.trace())
    if not trace > 0.0:
        return torch.zeros(3, dtype=torch.float64)
    damped = matrix + damping * torch.diag(matrix.diagonal()) + 1e-9 * trace * torch.eye(3, dtype=torch.float64)
    step = torch.linalg.solve(damped, direction)
    return step * min(1.0, longest / max(float(step.norm()), 1e-300))


def cauchy_scale(weighted: Tensor) -> float:
    """The residual at which the Cauchy loss lets go: three medians, above rounding."""
    return CAUCHY_MEDIANS * float(weighted.abs().median()) + 1e-6


def _start(problem: LightProblem, position: Tensor, weighting: Weighting, begin: float) -> _State:
    columns = problem.evaluate(position)
    intensity = problem.moments(columns, weighting.base(problem).square()).intensity
    state = _State(position, columns, intensity, evaluations=1)
    state.steps.append(_step(problem, state, begin))
    return state


def _step(problem: LightProblem, state: _State, begin: float) -> Step:
    loss = problem.unexplained(state.columns, state.intensity)
    return Step(loss, state.position.clone(), state.intensity * problem.scale, time.perf_counter() - begin)


def _best(problem: LightProblem, states: list[_State], weighting: Weighting) -> _State:
    """The state with the least Cauchy loss, all judged at the scale of the one that fits best."""
    base = weighting.base(problem)
    residuals = [base * problem.residual(state.columns, state.intensity) for state in states]
    scale = min(cauchy_scale(residual) for residual in residuals)
    losses = [float((residual.double() / scale).square().log1p().mean()) for residual in residuals]
    return states[min(range(len(states)), key=losses.__getitem__)]


def _result(problem: LightProblem, best: _State, starts: list[_State], region: _Region, begin: float) -> FitResult:
    ones = torch.ones_like(problem.target[:, :1])
    spread = covariance(problem.moments(best.columns, ones), best.intensity, problem.target.numel())
    unit = torch.tensor([1.0] * 3 + [problem.scale] * 3, dtype=torch.float64)
    status = FitStatus.AT_BOUND if region.at_bound(best.position) else best.status
    return FitResult(
        lights=(PointLight(best.position, best.intensity * problem.scale),),
        status=status,
        reason=REASONS[status],
        loss=problem.unexplained(best.columns, best.intensity),
        iterations=sum(state.iterations for state in starts),
        evaluations=sum(state.evaluations for state in starts),
        lights_tried=1,
        seconds=time.perf_counter() - begin,
        covariance=(spread * unit[:, None] * unit[None, :],),
        trajectory=(*best.steps, _step(problem, best, begin)),
    )
