"""How starts are refined: points at once, spots with rims that are wide at first and sharpen in steps."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import ScheduleOptions
from rgspipe.fitting.search.compare import distinct, ranked
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import EmitterRig
from rgspipe.fitting.search.weighting import PLAIN, ROBUST, Weighting

#: A rim that is narrower by nature is fitted with this width [rad]: a hard edge has no derivative.
HARD_RIM = 0.01


def refined_starts(
    refiner: Refiner,
    rigs: Sequence[EmitterRig],
    iterations: int,
    options: ScheduleOptions,
    known: State | None = None,
) -> list[State]:
    """Those of the starts that are refined to the end, by at most `iterations` steps at a time.

    Points are refined under a robust loss. A spot that is a little off has all of its pool wrong, and a sun all that it
    lights through a window, which a robust loss takes for outliers; so rigs with an axis are refined by plain squares.

    Args:
        known: a state from which starts may have lights; see `Refiner.columns`.
    """
    aimed = any(emitter.axis is not None for rig in rigs for emitter in rig)
    turns, weighting = _turns(options, aimed), PLAIN if aimed else ROBUST
    rim = turns[0][0]
    states = [refiner.start(soft(rig, rim), weighting, known) for rig in rigs]
    if aimed:
        states = _best(refiner.problem, states, options.promising, weighting)
    for turn, (softness, steps) in enumerate(turns):
        if turn > 0:
            best = _best(refiner.problem, states, options.going_on, weighting)
            states = distinct(best, options.met, refiner.region.size)
        if softness != rim:
            rim = softness
            states = [refiner.at(state, soft(state.emitters, rim)) for state in states]
        states = [refiner.refined(state, weighting, min(steps, iterations)) for state in states]
    return states


def _turns(options: ScheduleOptions, aimed: bool) -> list[tuple[float, int]]:
    """Softness of edges [rad], and most steps, of each turn."""
    if not aimed:
        half = options.steps // 2
        return [(0.0, half), (0.0, options.steps - half)]
    return [*zip(options.softness, options.softly, strict=True), (0.0, options.steps)]


def soft(rig: EmitterRig, softness: float) -> EmitterRig:
    """The rig with rims that are `softness` wider, but none narrower than HARD_RIM."""
    return tuple(emitter.softened(max(softness, HARD_RIM if emitter.light.rim < HARD_RIM else 0.0)) for emitter in rig)


def _best(problem: LightProblem, states: Sequence[State], share: float, weighting: Weighting) -> list[State]:
    """The given share of the rigs, at least two: those with the lowest losses, best first."""
    count = max(2, math.ceil(share * len(states)))
    if weighting.robust:
        return ranked(problem, states)[:count]
    weights = problem.unclipped(weighting.base(problem))
    return sorted(states, key=lambda state: problem.moments(state.columns, weights).cost)[:count]
