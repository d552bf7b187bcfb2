"""How starts are refined: points at once, spots with rims that are wide at first and sharpen in steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rgspipe.fitting.judge import ranked
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.refine import ROBUST, Region, State, reevaluate, refine, start_from
from rgspipe.fitting.starts import Rig
from rgspipe.renderer.spot_share import rim_width

#: Steps of each start before the best one is chosen.
SHORT_ITERATIONS = 6

#: Spots are refined with rims that are wider by so much [rad], one after the other, by at most so many steps each; the
#: better half of the starts goes on each time.
SOFTENED = ((0.3, 3), (0.15, 4), (0.05, 4), (0.0, SHORT_ITERATIONS))

#: A rim that is narrower by nature is fitted with this width: a hard edge has no derivative.
HARD_RIM = 0.01


def refine_starts(
    problem: LightProblem, rigs: Sequence[Rig], iterations: int, region: Region, begin: float
) -> tuple[list[State], list[State]]:
    """All starts, and those of them that were refined to the end, by at most `iterations` steps at a time."""
    spots = any(emitter.is_spot for rig in rigs for emitter in rig)
    rims = SOFTENED if spots else ((0.0, SHORT_ITERATIONS),)
    started = [start_from(problem, soft(rig, rims[0][0]), ROBUST, begin) for rig in rigs]
    states = started
    for softness, steps in rims:
        if softness != rims[0][0]:
            states = _better_half(problem, states)
            for state in states:
                state.emitters = soft(state.emitters, softness)
                reevaluate(problem, state)
        for state in states:
            refine(problem, state, ROBUST, min(steps, iterations), region, begin)
    return started, states


def soft(rig: Rig, softness: float) -> Rig:
    """The rig with rims that are `softness` wider, but none narrower than HARD_RIM."""
    return tuple(
        replace(emitter, softness=max(softness, HARD_RIM if rim_width(emitter.shape) < HARD_RIM else 0.0))
        if emitter.is_spot
        else emitter
        for emitter in rig
    )


def _better_half(problem: LightProblem, states: Sequence[State]) -> list[State]:
    """The half of the rigs with the lower robust losses, at least two, best first."""
    return ranked(problem, states)[: max(2, (len(states) + 1) // 2)]
