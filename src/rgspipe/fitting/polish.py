"""The polish: what was chosen on blocks of pixels is brought to the end on all of them, bright spots seen well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rgspipe.fitting.certainty.uncertainty import design_effect
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.bright_spots import seeing_bright_spots
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN

#: What a fit leaves is noise if its `design_effect` is less: pixels share no more than that again. Images of the model
#: itself with 0.5 to 2 % of noise come to 0.8 to 0.9, path-traced ones in trained scenes to 5.7 and more, so half or
#: twice of it tells them apart as well.
NOISE = 2.0


def all_polished(refiner: Refiner, states: Sequence[State], iterations: int) -> tuple[Refiner, list[State]]:
    """`_polished` of each rig, the best first, with the refiner of that one."""
    every = [_polished(refiner, one, iterations) for one in states]
    every.sort(key=lambda pair: pair[0].unexplained(pair[1]))
    return every[0][0], [state for _, state in every]


def _polished(refiner: Refiner, best: State, iterations: int) -> tuple[Refiner, State]:
    """Plain squares to the end with all pixels, direct light where these look if views are ready for it.

    Returns:
        the refiner on the problem with the exposures that were found, from here on taken as known; and the rig.
    """
    best = refiner.refined(refiner.at(best, _told(best)), PLAIN, iterations)
    if (told := _told(best)) != best.emitters:
        best = refiner.at(best, told)
    problem = refiner.problem
    if problem.exposure_free:
        exposures = problem.moments(best.columns, PLAIN.at(problem, best.columns, best.intensity)).exposures
        problem = replace(problem.with_exposures(exposures), exposure_free=False)
    return refiner.on(problem), best


def seen_well(refiner: Refiner, states: Sequence[State], options: SearchOptions) -> tuple[Refiner, list[State]]:
    """The refiner and the rigs, the best first, with bright spots seen well; as they are where that explains much less.

    With spots left to patches least squares explain a little more by noise alone, at places that are worse (errors in
    variables). Images that the model of patches made are left to it: it explains them to rounding or to their noise.
    """
    problem = seeing_bright_spots(refiner.problem, states) if options.bright_spots else refiner.problem
    if problem is refiner.problem or design_effect(refiner.problem, states[0], options.certainty.cell) < NOISE:
        return refiner, [*states]
    better, seen = all_polished(refiner.on(problem), states, options.iterations)
    if better.unexplained(seen[0]) > options.rivals.energy * max(refiner.unexplained(states[0]), ROUNDING**2):
        return refiner, [*states]
    return better, seen


def _told(state: State) -> tuple[Emitter, ...]:
    """The lights of a rig by the numbers that results tell."""
    return tuple(emitter.told for emitter in state.emitters)
