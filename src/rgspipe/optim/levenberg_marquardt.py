"""Least squares by damped steps: Gauss and Newton's where the cost is as expected, short ones downhill where it is not.

Around a point x, residuals r with the Jacobian J make the cost Σ r² after a step s of the parameters

    c(x ⊞ s) ≈ c − 2 dᵀs + sᵀMs ,     M = JᵀJ ,     d = −Jᵀr ,

which is least at M s = d (Gauss and Newton). A damped step

    (M + λ diag M + ε tr M I) s = d

turns from that one (λ = 0) to a short one down the gradient as λ grows (Levenberg 1944). Damping by diag M makes steps
independent of the parameters' units (Marquardt 1963). A step that lowers the cost is taken, and λ falls; after one that
does not, λ rises.

What else there is to a problem stands in M, d and c. Known values x₀ with covariance C add δᵀC⁻¹δ to the cost, with
δ = x − x₀, C⁻¹ to M and −C⁻¹δ to d: the steps are those of an iterated extended Kalman filter (Bell and Cathey 1993).
Unknowns that the residuals are linear in answer every step in closed form and are no parameters (variable projection:
Golub and Pereyra 1973, with the Jacobian of Kaufman 1975). Weights of a robust loss are held while a step is looked for
(iteratively reweighted least squares). x ⊞ s is the problem's own: it may go along a curved space, or end at a bound.

A solver is a descent (which step), a search (how λ answers) and its ends, all of them plain data; `least_squares` is
the only door.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Generic, Protocol, TypeVar

import torch
from torch import Tensor

Point = TypeVar("Point")
Place = TypeVar("Place")


@dataclass(frozen=True)
class NormalEquations:
    """The cost around a point, up to squares of a step.

    Attributes:
        matrix: (D, D) float64 M.
        direction: (D,) float64 d.
        cost: c.
    """

    matrix: Tensor
    direction: Tensor
    cost: float

    def gain(self, step: Tensor) -> float:
        """By how much a step (D,) is expected to lower the cost, 2 dᵀs − sᵀMs."""
        return float(2.0 * step @ self.direction - step @ self.matrix @ step)


class Neighbourhood(Protocol[Place, Point]):
    """What a problem tells around a point; its steps are those of parameters that have about the same effect.

    Attributes:
        normal: the normal equations, of D parameters.
    """

    normal: NormalEquations

    def allowed(self, step: Tensor) -> float:
        """By which part, in (0, 1], a step (D,) has to be shortened for the equations to be trusted."""

    def moved(self, step: Tensor) -> Place:
        """The place after a step (D,), within the bounds; nothing that takes time has been looked at there."""

    def distance(self, place: Place) -> float:
        """How far a place is from the point, in about the units of the parameters."""

    def evaluated(self, place: Place) -> tuple[float, Point]:
        """The cost at a place, as the normal equations count it, and the place as a point to go on from."""


class Problem(Protocol[Point]):
    """A sum of squares to be made small."""

    def around(self, point: Point) -> Neighbourhood[Any, Point]:
        """The problem around a point."""


class Ended(StrEnum):
    """Why a descent ended."""

    #: No further step is expected to gain anything that matters.
    CONVERGED = "converged"
    #: Steps that should have lowered the cost did not: what is left of it is rounding, or the derivatives are wrong.
    STALLED = "stalled"
    #: All steps were taken while the cost was still falling.
    OUT_OF_STEPS = "out_of_steps"


@dataclass(frozen=True)
class Solution(Generic[Point]):
    """Where a descent came to.

    Attributes:
        value: the last point.
        ended: why it is the last.
        iterations: steps that were taken.
        evaluations: places at which the cost was asked for, the start not among them.
        gain: by what share the last step lowered the cost; 0 if none was taken.
    """

    value: Point
    ended: Ended
    iterations: int
    evaluations: int
    gain: float


@dataclass(frozen=True)
class DampedDescent:
    """Which step is taken at a damping λ.

    Attributes:
        ridge: ε, which keeps the equations solvable where a parameter has no effect.
    """

    ridge: float = 1e-9

    def step(self, normal: NormalEquations, damping: float) -> Tensor:
        """(D,) the damped step; zero where the residuals determine nothing."""
        matrix = normal.matrix
        trace = float(matrix.trace())
        if not trace > 0.0:
            return torch.zeros_like(normal.direction)
        damped = (
            matrix + damping * torch.diag(matrix.diagonal()) + self.ridge * trace * torch.eye(len(matrix)).to(matrix)
        )
        return torch.linalg.solve(damped, normal.direction)


@dataclass(frozen=True)
class DampingSearch:
    """How λ answers to steps.

    Attributes:
        first: λ of the first step.
        eased, raised: factors of λ after a step that lowered the cost, and after one that did not.
        least: λ falls no lower; steps are those of Gauss and Newton long before.
        attempts: how many steps from one point may fail.
    """

    first: float = 1e-2
    eased: float = 0.2
    raised: float = 6.0
    least: float = 1e-6
    attempts: int = 5


@dataclass(frozen=True)
class Stopping:
    """When a descent ends. Lengths are those of `Neighbourhood.distance`.

    Attributes:
        least_gain: steps that are expected to lower the cost by less than this share of it are not taken.
        shortest_step, small_gain: a descent ends after a step shorter than `shortest_step` that lowered the cost by
            less than the share `small_gain`: where next to nothing is left unexplained, short steps still gain. Nor is
            a step so short tried again if it fails. Fits that end by the default differ by at most half of it from
            those that go on to a hundredth of it, and take a sixth less time (docs/reference/model/search.md).
        shortest_move: shorter steps are none.
    """

    least_gain: float = 1e-5
    shortest_step: float = 1e-4
    small_gain: float = 0.05
    shortest_move: float = 2e-7


@dataclass(frozen=True)
class LevenbergMarquardt:
    """A solver as data."""

    descent: DampedDescent = field(default_factory=DampedDescent)
    search: DampingSearch = field(default_factory=DampingSearch)
    stopping: Stopping = field(default_factory=Stopping)


def least_squares(
    problem: Problem[Point],
    start: Point,
    iterations: int,
    solver: LevenbergMarquardt | None = None,
    watch: Callable[[Point], None] | None = None,
) -> Solution[Point]:
    """A point of least cost near `start`.

    Args:
        iterations: most steps that are taken.
        solver: with its defaults if None.
        watch: is shown the point after every step.
    """
    solver = solver or LevenbergMarquardt()
    point, damping, gain, evaluations = start, solver.search.first, 0.0, 0
    for taken in range(iterations):
        found = _lowered(problem.around(point), damping, solver)
        evaluations += found.evaluations
        if isinstance(found, _NoStep):
            return Solution(point, found.ended, taken, evaluations, gain)
        point, damping, gain = found.point, found.damping, found.gain
        if watch is not None:
            watch(point)
        if found.distance < solver.stopping.shortest_step and gain < solver.stopping.small_gain:
            return Solution(point, Ended.CONVERGED, taken + 1, evaluations, gain)
    return Solution(point, Ended.OUT_OF_STEPS, iterations, evaluations, gain)


@dataclass(frozen=True)
class _Step(Generic[Point]):
    """A step that lowered the cost by the share `gain`, and λ for the next one."""

    point: Point
    distance: float
    gain: float
    damping: float
    evaluations: int


@dataclass(frozen=True)
class _NoStep:
    """There is none."""

    ended: Ended
    evaluations: int


def _lowered(around: Neighbourhood[Any, Point], damping: float, solver: LevenbergMarquardt) -> _Step[Point] | _NoStep:
    """The first of ever more damped steps that lowers the cost."""
    normal, search, stopping = around.normal, solver.search, solver.stopping
    for attempt in range(search.attempts):
        step = solver.descent.step(normal, damping)
        step = step * around.allowed(step)
        gain, least = normal.gain(step), stopping.least_gain * normal.cost
        if not gain >= least:
            # What is no number, or follows on a step of which more was expected, is no convergence.
            settled = gain < least and attempt == 0
            return _NoStep(Ended.CONVERGED if settled else Ended.STALLED, attempt)
        place = around.moved(step)
        distance = around.distance(place)
        if distance < stopping.shortest_move:
            return _NoStep(Ended.CONVERGED, attempt)
        cost, point = around.evaluated(place)
        if cost < normal.cost:
            eased = max(search.eased * damping, search.least)
            return _Step(point, distance, 1.0 - cost / normal.cost, eased, attempt + 1)
        if distance < stopping.shortest_step:
            return _NoStep(Ended.STALLED, attempt + 1)
        damping *= search.raised
    return _NoStep(Ended.STALLED, search.attempts)


def within(length: float, longest: float) -> float:
    """By which part, in (0, 1], a step has to be shortened for one of its lengths to be at most `longest`."""
    return min(1.0, longest / max(length, 1e-300))
