"""How starts are refined: points at once, spots with rims that are wide at first and sharpen in steps."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.judge import distinct, ranked
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import Rig
from rgspipe.fitting.search.weighting import PLAIN, ROBUST, Weighting

#: Steps of a start to the end.
SHORT_ITERATIONS = 6

#: Turns of a refinement: rims that are wider by so much [rad], and steps at most.
POINT_TURNS = ((0.0, 3), (0.0, SHORT_ITERATIONS - 3))
AIMED_TURNS = ((0.3, 3), (0.15, 4), (0.05, 4), (0.0, SHORT_ITERATIONS))

#: Shares of the starts, at least two of them, that take a turn after the one before: the best go on. Thoroughly: where
#: the best starts of all failed.
GOING_ON, GOING_ON_THOROUGHLY = 0.4, 0.5

#: Share of spots' starts that take the first turn, by how they look before it.
PROMISING = 0.67

#: A rim that is narrower by nature is fitted with this width: a hard edge has no derivative.
HARD_RIM = 0.01


def refine_starts(refiner: Refiner, rigs: Sequence[Rig], iterations: int, thorough: bool = False) -> list[State]:
    """Those of the starts that are refined to the end, by at most `iterations` steps at a time.

    Points are refined under a robust loss. A spot that is a little off has all of its pool wrong, which a robust loss
    takes for outliers; so rigs with spots are refined by plain squares.
    """
    aimed = any(emitter.axis is not None for rig in rigs for emitter in rig)
    turns, weighting = (AIMED_TURNS, PLAIN) if aimed else (POINT_TURNS, ROBUST)
    share, rim = GOING_ON_THOROUGHLY if thorough else GOING_ON, turns[0][0]
    states = [refiner.start(soft(rig, rim), weighting) for rig in rigs]
    if aimed and not thorough:
        states = _best(refiner.problem, states, PROMISING, weighting)
    for turn, (softness, steps) in enumerate(turns):
        if turn > 0:
            states = distinct(_best(refiner.problem, states, share, weighting), refiner.region.size)
        if softness != rim:
            rim = softness
            states = [refiner.at(state, soft(state.emitters, rim)) for state in states]
        states = [refiner.refined(state, weighting, min(steps, iterations)) for state in states]
    return states


def soft(rig: Rig, softness: float) -> Rig:
    """The rig with rims that are `softness` wider, but none narrower than HARD_RIM."""
    return tuple(emitter.softened(max(softness, HARD_RIM if emitter.light.rim < HARD_RIM else 0.0)) for emitter in rig)


def _best(problem: LightProblem, states: Sequence[State], share: float, weighting: Weighting) -> list[State]:
    """The given share of the rigs, at least two: those with the lowest losses, best first."""
    count = max(2, math.ceil(share * len(states)))
    if weighting.robust:
        return ranked(problem, states)[:count]
    weights = problem.unclipped(weighting.base(problem))
    return sorted(states, key=lambda state: problem.moments(state.columns, weights).cost)[:count]
