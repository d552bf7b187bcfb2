"""What blocks found, polished by plain squares on pixels: at first on few of them, and on few points of a light.

An image of all pixels is dear, and most steps of a descent need none: what a model gets wrong is alike in neighbouring
pixels, so that few of them put lights where all do but for a small part of their error. All have the last word.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rgspipe.fitting.certainty.uncertainty import design_effect
from rgspipe.fitting.course import BESIDE, BRIGHT_SPOTS, weight
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.beside import settled_beside, steps_aside
from rgspipe.fitting.search.bright_spots import seeing_bright_spots
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.rivals import leaves_as_little

#: What a fit leaves is noise if its `design_effect` is less: pixels share no more than that again. Images of the model
#: itself with 0.5 to 2 % of noise come to 0.8 to 0.9, path-traced ones in trained scenes to 5.7 and more, so half or
#: twice of it tells them apart as well.
NOISE = 2.0


def polished_on_pixels(
    blocks: Refiner, problem: LightProblem, states: Sequence[State], options: SearchOptions
) -> tuple[Refiner, list[State]]:
    """The rigs that blocks do not tell apart, and minima beside the best of them; the best first.

    Those that few pixels rule out come last, as they are there.

    Args:
        blocks: the refiner that found the rigs.
        problem: of all pixels.

    Returns:
        the refiner of all pixels, with the exposures that were found, from here on taken as known; and the rigs.
    """
    course, size = blocks.meter.course, weight(states[0].emitters)
    whole = problem.sharpest()
    few = whole.of_few_pixels()
    with course.polishing(size, len(states)):
        rough, (best, *others) = _all_polished(blocks.on(few.of_few_points()), states, options.iterations)
    with course.part("looking beside", BESIDE * size, 2 * steps_aside(options)):
        best, beside = settled_beside(rough, best, options, blocks)
    near, worse = [best], []
    for other in (*others, *beside):
        (near if leaves_as_little(rough, best, other, options.rivals) else worse).append(other)
    polished = rough
    if any(len(emitter.light.parts()) > 1 for emitter in best.emitters):
        with course.polishing(size, len(near), planned=0):
            polished, near = _all_polished(blocks.on(few), near, options.iterations)
    with course.part("bright spots", BRIGHT_SPOTS * size, len(near)):
        polished, near = seen_well(polished, near, options, len(whole.target))
    if few is not whole:
        whole = whole.in_scene(polished.problem.views.frozen)
        with course.polishing(size, len(near)):
            polished, near = _all_polished(blocks.on(whole), near, options.iterations)
    if polished is not rough:
        worse = [polished.start(other.emitters, PLAIN) for other in worse]
    return polished, [*near, *worse]


def seen_well(
    refiner: Refiner, states: Sequence[State], options: SearchOptions, pixels: int | None = None
) -> tuple[Refiner, list[State]]:
    """The refiner and the rigs, the best first, with bright spots seen well; as they are where that explains much less.

    With spots left to patches least squares explain a little more by noise alone, at places that are worse (errors in
    variables). Images that the model of patches made are left to it: it explains them to rounding or to their noise.

    Args:
        pixels: how many there are, if the refiner looks at a part of them.
    """
    problem = seeing_bright_spots(refiner.problem, states) if options.bright_spots else refiner.problem
    if problem is refiner.problem or _is_noise(refiner.problem, states[0], options.certainty.cell, pixels):
        return refiner, [*states]
    better, seen = _all_polished(refiner.on(problem), states, options.iterations)
    if better.unexplained(seen[0]) > options.rivals.energy * max(refiner.unexplained(states[0]), ROUNDING**2):
        return refiner, [*states]
    return better, seen


def _is_noise(problem: LightProblem, state: State, cell: float, pixels: int | None) -> bool:
    """Whether what a rig leaves is another in each pixel: what pixels share grows with their number."""
    more = (pixels or len(problem.target)) / len(problem.target)
    return 1.0 + more * (design_effect(problem, state, cell) - 1.0) < NOISE


def _all_polished(refiner: Refiner, states: Sequence[State], iterations: int) -> tuple[Refiner, list[State]]:
    """`_polished` of each rig, the best first, with the refiner of that one."""
    every = [_polished(refiner, one, iterations) for one in states]
    every.sort(key=lambda pair: pair[0].unexplained(pair[1]))
    return every[0][0], [state for _, state in every]


def _polished(refiner: Refiner, best: State, iterations: int) -> tuple[Refiner, State]:
    """Plain squares to the end.

    Returns:
        the refiner on the problem with the exposures that were found, from here on taken as known; and the rig.
    """
    best = refiner.refined(refiner.at(best, _told(best)), PLAIN, iterations)
    if (told := _told(best)) != best.emitters:
        best = refiner.at(best, told)
    return exposed(refiner, best), best


def exposed(refiner: Refiner, best: State) -> Refiner:
    """The refiner on the problem with the exposures of a rig's images, from here on taken as known."""
    problem = refiner.problem
    if problem.exposure_free:
        exposures = problem.moments(best.columns, PLAIN.at(problem, best.columns, best.intensity)).exposures
        problem = replace(problem.with_exposures(exposures), exposure_free=False)
    return refiner.on(problem)


def _told(state: State) -> tuple[Emitter, ...]:
    """The lights of a rig by the numbers that results tell."""
    return tuple(emitter.told for emitter in state.emitters)
