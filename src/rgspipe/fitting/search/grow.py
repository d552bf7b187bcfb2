"""Lights with an extent: found as the points that they look like from afar, then grown."""

from __future__ import annotations

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import distinct, drop, ranked
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.rig_search import Found
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.scene.lights import Light

#: Clearly different rigs of points that are grown: what explains most as points need not do so with an extent.
RIGS = 2


def grown(refiner: Refiner, found: Found, kind: Light, shape_free: bool, options: SearchOptions) -> Found:
    """What was found, with lights of `kind` in the place of points.

    Args:
        kind: a light of the extent that they have, or may have, wherever it is.
        shape_free: whether their extent is looked for, too.
    """
    problem, best = refiner.problem, found.best
    near = [one for one in found.others if drop(problem, one, best) < options.bar.least]
    rigs = [best, *ranked(problem, near)]
    few = distinct(rigs, options.certainty.doubtful, refiner.region.size)[:RIGS]
    states = [_grown(refiner, state, kind, shape_free, options.schedule.steps) for state in few]
    best = min(states, key=refiner.unexplained)
    return Found(best, tuple(states), {len(best.emitters): best})


def _grown(refiner: Refiner, state: State, kind: Light, shape_free: bool, steps: int) -> State:
    """The rig after some steps of the best of several sizes."""
    states = []
    for size in kind.grown(refiner.region.size) if shape_free else (kind,):
        rig = [Emitter.of(size.at(one.position, one.axis), shape_free) for one in state.emitters]
        states.append(refiner.refined(refiner.start(rig, PLAIN), PLAIN, steps))
    return min(states, key=refiner.unexplained)
