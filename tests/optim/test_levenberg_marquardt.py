"""Damped least squares on problems whose answers are known in closed form."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from rgspipe.optim.levenberg_marquardt import (
    DampedDescent,
    DampingSearch,
    Ended,
    LevenbergMarquardt,
    NormalEquations,
    Stopping,
    least_squares,
    within,
)

#: No bound.
FREE = (-math.inf, math.inf)

#: Undamped, and to the end.
NEWTON = LevenbergMarquardt(DampedDescent(ridge=0.0), DampingSearch(first=0.0, least=0.0), Stopping(0.0, 0.0, 0.0, 0.0))

#: Far below the default's ends.
LONG = LevenbergMarquardt(stopping=Stopping(1e-20, 1e-12, 1e-6, 1e-12))


@dataclass(frozen=True)
class Residuals:
    """Residuals as a function of x (D,), in parameters that are x over `units`, between bounds."""

    function: Callable[[Tensor], Tensor]
    units: Tensor | float = 1.0
    bounds: tuple[float, float] = FREE
    longest: float = math.inf
    asked: list[Tensor] = field(default_factory=list)

    def around(self, point: Tensor) -> Around:
        return Around(self, point)

    def cost(self, point: Tensor) -> float:
        return float(self.function(point).square().sum())


@dataclass(frozen=True)
class Around:
    whole: Residuals
    point: Tensor

    @cached_property
    def normal(self) -> NormalEquations:
        jacobian = torch.autograd.functional.jacobian(self.whole.function, self.point) * self.whole.units
        return NormalEquations(
            jacobian.T @ jacobian, -jacobian.T @ self.whole.function(self.point), self.whole.cost(self.point)
        )

    def allowed(self, step: Tensor) -> float:
        return within(float(step.norm()), self.whole.longest)

    def moved(self, step: Tensor) -> Tensor:
        return (self.point + self.whole.units * step).clamp(*self.whole.bounds)

    def distance(self, place: Tensor) -> float:
        return float(((place - self.point) / self.whole.units).norm())

    def evaluated(self, place: Tensor) -> tuple[float, Tensor]:
        self.whole.asked.append(place)
        return self.whole.cost(place), place


def vector(*values: float) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


def rosenbrock(x: Tensor) -> Tensor:
    return torch.stack([10.0 * (x[1] - x[0].square()), 1.0 - x[0]])


def line(x: Tensor) -> Tensor:
    """x₀ + t x₁ against values at four t: linear, with a residual that stays."""
    t = vector(0.0, 1.0, 2.0, 3.0)
    return x[0] + t * x[1] - vector(1.0, 0.0, 3.0, 4.0)


def test_an_undamped_step_answers_a_linear_problem() -> None:
    found = least_squares(Residuals(line), vector(7.0, -5.0), 1, NEWTON)
    # Normal equations by hand: (4, 6; 6, 14) x = (8, 18).
    torch.testing.assert_close(found.value, vector(0.2, 1.2), rtol=0.0, atol=1e-14)
    assert (found.iterations, found.evaluations, found.ended) == (1, 1, Ended.OUT_OF_STEPS)
    assert found.gain == pytest.approx(1.0 - 2.8 / Residuals(line).cost(vector(7.0, -5.0)), rel=1e-12)


def test_a_linear_problem_converges() -> None:
    found = least_squares(Residuals(line), vector(7.0, -5.0), 30)
    assert found.ended is Ended.CONVERGED and found.iterations <= 3
    torch.testing.assert_close(found.value, vector(0.2, 1.2), rtol=0.0, atol=1e-4)  # measured 9e-6


def test_a_curved_valley_is_followed_to_its_end() -> None:
    problem = Residuals(rosenbrock)
    found = least_squares(problem, vector(-1.2, 1.0), 100, LONG)
    torch.testing.assert_close(found.value, vector(1.0, 1.0), rtol=0.0, atol=1e-9)  # measured 2e-13
    assert found.ended is Ended.CONVERGED and found.evaluations == len(problem.asked) < 40  # measured 29


def test_steps_are_no_longer_than_allowed() -> None:
    path = [vector(-1.2, 1.0)]
    least_squares(Residuals(rosenbrock, longest=0.1), path[0], 100, LONG, watch=path.append)
    lengths = [float((after - before).norm()) for before, after in itertools.pairwise(path)]
    assert max(lengths) == pytest.approx(0.1) and len(lengths) > 20
    torch.testing.assert_close(path[-1], vector(1.0, 1.0), rtol=0.0, atol=1e-9)  # measured 4e-13


def test_a_bound_holds_what_lies_beyond_it() -> None:
    """Free, x₁ would be 1.2. With x₁ = 0.5 the best x₀ is 2 − 1.5 · 0.5 = 1.25, which is beyond the bound, too."""
    found = least_squares(Residuals(line, bounds=(-math.inf, 0.5)), vector(0.0, 0.0), 50, LONG)
    assert found.value.tolist() == [0.5, 0.5] and found.ended is Ended.CONVERGED


def test_what_is_not_determined_stays() -> None:
    """Only the sum of two parameters is seen, and of a third nothing."""
    problem = Residuals(lambda x: torch.stack([x[0] + x[1] - 3.0, 0.0 * x[2]]))
    found = least_squares(problem, vector(0.0, 0.0, 5.0), 30, LONG)
    torch.testing.assert_close(found.value, vector(1.5, 1.5, 5.0), rtol=0.0, atol=1e-12)  # measured 7e-14


def test_a_problem_of_nothing_converges_at_once() -> None:
    found = least_squares(Residuals(lambda x: 0.0 * x), vector(1.0, 2.0), 5)
    assert (found.iterations, found.evaluations, found.ended) == (0, 0, Ended.CONVERGED)


def test_known_values_alone_are_the_answer() -> None:
    """The cost δᵀC⁻¹δ and nothing else: one undamped step leads to the known values."""
    root = torch.linalg.cholesky(torch.tensor([[4.0, 1.0], [1.0, 0.5]], dtype=torch.float64)).inverse()
    known = vector(3.0, -2.0)
    found = least_squares(Residuals(lambda x: root @ (x - known)), vector(0.0, 0.0), 1, NEWTON)
    torch.testing.assert_close(found.value, known, rtol=1e-14, atol=1e-14)


def test_a_cost_that_is_no_number_is_refused() -> None:
    """√(1 − x) has no value beyond 1, where the first steps from 0.9 would lead."""
    problem = Residuals(lambda x: torch.stack([(1.0 - x[0]).sqrt() + 1.0, 1e-3 * (x[0] - 9.0)]))
    found = least_squares(problem, vector(0.9), 20)
    assert any(math.isnan(problem.cost(place)) for place in problem.asked)
    assert 0.9 <= float(found.value) <= 1.0 and math.isfinite(problem.cost(found.value))


@pytest.mark.parametrize("start", [math.nan, 2.0])
def test_no_step_is_taken_from_where_there_is_no_cost(start: float) -> None:
    found = least_squares(Residuals(lambda x: (1.0 - x).sqrt()), vector(start), 5)
    assert (found.iterations, found.evaluations, found.ended) == (0, 0, Ended.STALLED)


def test_wrong_derivatives_stall() -> None:
    @dataclass(frozen=True)
    class Uphill(Around):
        @cached_property
        def normal(self) -> NormalEquations:
            right = Around(self.whole, self.point).normal
            return NormalEquations(right.matrix, -right.direction, right.cost)

    @dataclass(frozen=True)
    class Wrong(Residuals):
        def around(self, point: Tensor) -> Around:
            return Uphill(self, point)

    found = least_squares(Wrong(line), vector(7.0, -5.0), 30)
    assert (found.iterations, found.evaluations, found.ended) == (0, DampingSearch().attempts, Ended.STALLED)


def sums(x: Tensor) -> Tensor:
    """A sum of two exponentials at six times against one with some noise: nonlinear, and ill-conditioned."""
    t = torch.linspace(0.0, 2.0, 6, dtype=torch.float64)
    data = vector(3.02, 2.21, 1.58, 1.27, 0.96, 0.75)
    return x[0] * (-x[1] * t).exp() + x[2] * (-x[3] * t).exp() - data


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-2.0, 3.0), min_size=4, max_size=4), st.floats(1e-4, 10.0), st.floats(0.05, 5.0))
def test_the_cost_never_rises(start: list[float], damping: float, longest: float) -> None:
    problem = Residuals(sums, longest=longest)
    path = [vector(*start)]
    solver = LevenbergMarquardt(search=DampingSearch(first=damping))
    found = least_squares(problem, path[0], 15, solver, watch=path.append)
    costs = [problem.cost(point) for point in path]
    assert all(after < before for before, after in itertools.pairwise(costs))
    assert found.value is path[-1] and found.iterations == len(path) - 1 <= found.evaluations


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.1, 3.0), min_size=4, max_size=4), st.lists(st.integers(-6, 6), min_size=4, max_size=4))
def test_units_of_the_parameters_do_not_matter(start: list[float], powers: list[int]) -> None:
    """Marquardt's damping: the same problem in other units takes the same path."""
    paths = []
    for units in (torch.ones(4).double(), vector(*(2.0**power for power in powers))):
        path = [vector(*start)]
        solver = LevenbergMarquardt(DampedDescent(ridge=0.0), DampingSearch(first=0.1, least=0.1), NEWTON.stopping)
        least_squares(Residuals(sums, units), path[0], 3, solver, watch=path.append)
        paths.append(torch.stack(path))
    assert len(paths[0]) == len(paths[1])
    torch.testing.assert_close(paths[0], paths[1], rtol=1e-6, atol=1e-6)
