"""Levenberg-Marquardt on all lights of a rig together, with the intensities in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.exposure import ExposedMoments
from rgspipe.fitting.model.moments import Moments
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import StepLimits
from rgspipe.fitting.result import Step
from rgspipe.fitting.search.moves import Region, allowed_share, moved_rig, rig_move
from rgspipe.fitting.search.weighting import Weighting
from rgspipe.optim.levenberg_marquardt import Ended, LevenbergMarquardt, NormalEquations, Problem, least_squares
from rgspipe.scene import LightRig

#: What a descent's end is for a fit: where no step lowers the cost any more, a minimum is reached, to rounding.
STATUSES = {
    Ended.CONVERGED: FitStatus.CONVERGED,
    Ended.STALLED: FitStatus.CONVERGED,
    Ended.OUT_OF_STEPS: FitStatus.MAX_ITERATIONS,
}


@dataclass(frozen=True)
class State:
    """Where a refinement stands.

    Attributes:
        emitters: the L lights.
        columns: per light its image and derivatives, see `LightProblem.evaluate`; and then the known images.
        intensity: (L, 3) over the problem's scale, and how strong known images are in rows behind them.
        steps: how it got there.
        status: why it stopped there.
    """

    emitters: tuple[Emitter, ...]
    columns: tuple[Tensor, ...]
    intensity: Tensor
    steps: tuple[Step, ...] = ()
    status: FitStatus = FitStatus.MAX_ITERATIONS

    def lights(self, problem: LightProblem) -> LightRig:
        """The lights with their intensities, in the units of the images."""
        return tuple(
            emitter.shining(problem.scale * strength)
            for emitter, strength in zip(self.emitters, self.intensity[: len(self.emitters)], strict=True)
        )


@dataclass(frozen=True)
class Refiner:
    """Refines rigs on one problem, and records what that takes.

    Attributes:
        region: where lights may be.
        meter: of the fit.
        solver, limits: how steps are taken, and how long they may be. Found by trial, and little hangs on them: over 20
            rigs of a modelled room (a point light, two, a spot; two views with 2 % of noise) half or twice any of their
            numbers changes the renderings by -1 to 6 % (attempts: 11 %) and the median error by at most 2 %.
    """

    problem: LightProblem
    region: Region
    meter: Meter
    solver: LevenbergMarquardt = field(default_factory=LevenbergMarquardt)
    limits: StepLimits = field(default_factory=StepLimits)

    @classmethod
    def of(cls, problem: LightProblem, meter: Meter | None = None, limits: StepLimits | None = None) -> Refiner:
        """For a fit of its own, which begins now, or that of `meter`."""
        return cls(problem, Region.of(problem.views.frozen), meter or Meter(), limits=limits or StepLimits())

    def on(self, problem: LightProblem) -> Refiner:
        """The same fit's refiner on another problem: of other pixels, say."""
        return replace(self, problem=problem)

    def start(self, rig: Sequence[Emitter], weighting: Weighting, known: State | None = None) -> State:
        """The state at `rig`, with the intensities that belong to it; see `columns` for `known`."""
        problem, columns = self.problem, self.columns(rig, known)
        weights = problem.unclipped(weighting.base(problem).square())
        state = State(tuple(rig), columns, problem.moments(columns, weights).intensity)
        return replace(state, steps=(self.step(state),))

    def at(self, state: State, rig: Sequence[Emitter]) -> State:
        """`state` with the lights `rig` and the intensities that it has."""
        return replace(state, emitters=tuple(rig), columns=self.columns(rig))

    def refined(self, state: State, weighting: Weighting, iterations: int) -> State:
        """A minimum of the weighted loss near `state`, by at most `iterations` steps."""
        projected = _ProjectedRig(self, weighting)
        found = self.descended(projected, state, iterations)
        # The intensity that belongs to the last position under this weighting.
        return replace(found, intensity=projected.around(found).moments.intensity)

    def descended(self, squares: Problem[State], start: State, iterations: int) -> State:
        """The least squares of any problem in these lights, with the steps that led there."""
        steps = [*start.steps]

        def watch(state: State) -> None:
            steps.append(self.step(state))
            self.meter.course.step(len(steps) - len(start.steps), iterations)

        found = least_squares(squares, start, iterations, self.solver, watch)
        self.meter.course.piece()
        self.meter.iterations += found.iterations
        return replace(found.value, steps=tuple(steps), status=STATUSES[found.ended])

    def columns(self, rig: Sequence[Emitter], known: State | None = None) -> tuple[Tensor, ...]:
        """`LightProblem.evaluate` of each light and the known images; lights that `known` has are not made again.

        Args:
            known: a state of this problem; a light of it is one that is the same object.
        """
        pairs = () if known is None else zip(known.emitters, known.columns, strict=False)
        made = {id(emitter): columns for emitter, columns in pairs}
        self.meter.evaluations += self.problem.renderings([one for one in rig if id(one) not in made])
        lights = (made[id(one)] if id(one) in made else self.problem.evaluate(one) for one in rig)
        return (*lights, *self.problem.known_columns)

    def step(self, state: State) -> Step:
        """The state as a step of the fit, now."""
        return Step(self.unexplained(state), state.lights(self.problem), self.meter.seconds)

    def unexplained(self, state: State) -> float:
        """`LightProblem.unexplained`."""
        return self.problem.unexplained(state.columns, state.intensity)

    def normal(self, state: State, weighting: Weighting) -> NormalEquations:
        """What a step from `state` would solve, in the parameters of all lights."""
        return _ProjectedRig(self, weighting).around(state).normal

    def weights(self, state: State, weighting: Weighting) -> Tensor:
        """Squared weights of reweighted least squares at the state's residual."""
        return weighting.at(self.problem, state.columns, state.intensity)


@dataclass(frozen=True)
class _ProjectedRig:
    """Lights whose intensities answer every step in closed form, as a problem of least squares."""

    refiner: Refiner
    weighting: Weighting

    def around(self, state: State) -> _AroundRig:
        weights = self.refiner.weights(state, self.weighting)
        return _AroundRig(self.refiner, state, weights, self.refiner.problem.moments(state.columns, weights))


@dataclass(frozen=True)
class _AroundRig:
    """The problem around a state, with the weights that it gives the pixels."""

    refiner: Refiner
    state: State
    weights: Tensor
    moments: Moments | ExposedMoments

    @cached_property
    def normal(self) -> NormalEquations:
        units = torch.cat([emitter.units(self.refiner.region.size) for emitter in self.state.emitters])
        matrix, direction = self.moments.parameter_system()
        return NormalEquations(matrix * units[:, None] * units[None, :], direction * units, self.moments.cost)

    def allowed(self, step: Tensor) -> float:
        return allowed_share(self.state.emitters, step, self.refiner.limits)

    def moved(self, step: Tensor) -> tuple[Emitter, ...]:
        return moved_rig(self.state.emitters, step, self.refiner.region)

    def distance(self, rig: tuple[Emitter, ...]) -> float:
        return rig_move(self.state.emitters, rig, self.refiner.region.size)

    def evaluated(self, rig: tuple[Emitter, ...]) -> tuple[float, State]:
        columns = self.refiner.columns(rig, self.state)
        moments = self.refiner.problem.moments(columns, self.weights)
        return moments.cost, replace(self.state, emitters=rig, columns=columns, intensity=moments.intensity)
