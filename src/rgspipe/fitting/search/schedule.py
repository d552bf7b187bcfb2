"""How starts are refined: points at once, spots with rims that are wide at first and sharpen in steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.compare import Likeness, ranked
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import Rig
from rgspipe.fitting.search.weighting import PLAIN, ROBUST, Weighting

#: A rim that is narrower by nature is fitted with this width [rad]: a hard edge has no derivative.
HARD_RIM = 0.01


@dataclass(frozen=True)
class Schedule:
    """Turns of a refinement, and which starts go on from one to the next.

    Attributes:
        steps: of a start to the end, in its last turn.
        first: steps of a rig of points before the better ones go on.
        softness: of rigs with an axis: by how much edges are wider [rad] in the turns before the last one …
        softly: … and steps of each of these turns.
        going_on, thoroughly: shares of the starts, at least two of them, that take a turn after the one before: the
            best go on. Thoroughly where the best starts of all failed.
        promising: share of starts with an axis that take the first turn, by how they look before it.
        alike: which rigs are on their way to the same place, and refined once.
    """

    steps: int = 6
    first: int = 3
    softness: tuple[float, ...] = (0.3, 0.15, 0.05)
    softly: tuple[int, ...] = (3, 4, 4)
    going_on: float = 0.4
    thoroughly: float = 0.5
    promising: float = 0.67
    alike: Likeness = field(default_factory=Likeness)

    def turns(self, aimed: bool) -> list[tuple[float, int]]:
        """Softness of edges, and most steps, of each turn."""
        if not aimed:
            return [(0.0, self.first), (0.0, self.steps - self.first)]
        return [*zip(self.softness, self.softly, strict=True), (0.0, self.steps)]

    def refined(self, refiner: Refiner, rigs: Sequence[Rig], iterations: int, thorough: bool = False) -> list[State]:
        """Those of the starts that are refined to the end, by at most `iterations` steps at a time.

        Points are refined under a robust loss. A spot that is a little off has all of its pool wrong, which a robust
        loss takes for outliers; so rigs with an axis are refined by plain squares.
        """
        aimed = any(emitter.axis is not None for rig in rigs for emitter in rig)
        turns, weighting = self.turns(aimed), PLAIN if aimed else ROBUST
        share, rim = self.thoroughly if thorough else self.going_on, turns[0][0]
        states = [refiner.start(soft(rig, rim), weighting) for rig in rigs]
        if aimed and not thorough:
            states = _best(refiner.problem, states, self.promising, weighting)
        for turn, (softness, steps) in enumerate(turns):
            if turn > 0:
                best = _best(refiner.problem, states, share, weighting)
                states = self.alike.distinct(best, refiner.region.size)
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
