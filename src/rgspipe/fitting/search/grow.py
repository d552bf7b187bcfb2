"""Lights with an extent: found as the points that they look like from afar, then grown."""

from __future__ import annotations

from dataclasses import replace

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import distinct, drop, ranked
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.rig_search import Found
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.spec import LightSpec
from rgspipe.scene.lights import Light
from rgspipe.scene.walls import walls_near

#: Starts that are refined, of all that are tried: sizes of clearly different rigs, as they were found and as they lie
#: on surfaces.
STARTS = 2

#: Walls that a light may lie on are looked for among so many that are nearest to where a point explains most.
WALLS = 3


def grown(refiner: Refiner, found: Found, spec: LightSpec, options: SearchOptions) -> Found:
    """What was found, with lights that have an extent in the place of points."""
    problem, size, kind = refiner.problem, refiner.region.size, spec.kinds[-1]
    near = [one for one in found.others if drop(problem, one, found.best) < options.bar.least]
    rigs = [
        rig
        for state in distinct([found.best, *ranked(problem, near)], options.certainty.doubtful, size)
        for sized in kind.grown(size, spec.shape_free)
        for rig in _rigs(refiner, state, sized, spec)
    ]
    starts = sorted((refiner.start(rig, PLAIN) for rig in rigs), key=refiner.unexplained)[:STARTS]
    states = [refiner.refined(start, PLAIN, options.schedule.steps) for start in starts]
    best = min(states, key=refiner.unexplained)
    return Found(best, tuple(states), {len(best.emitters): best})


def _rigs(refiner: Refiner, state: State, sized: Light, spec: LightSpec) -> list[tuple[Emitter, ...]]:
    """The rig with lights of a size, or a turn, in the place of points; of such as may lie on a surface also there."""
    free, rigs = spec.shape_free, []
    if not (sized.flush and spec.mounted):
        rigs.append(tuple(Emitter.of(sized.in_place_of(one.light), free) for one in state.emitters))
    if sized.flush:
        surfels, size = refiner.problem.views.frozen.surfels, refiner.region.size
        walls = [walls_near(surfels, one.position, size, WALLS) for one in state.emitters]
        for chosen in zip(*walls, strict=False):
            laid = [Emitter.of(sized.at(wall.place, wall.normal), free) for wall in chosen]
            pairs = zip(laid, chosen, strict=True)
            rigs.append(tuple(replace(one, plane=wall.normal) for one, wall in pairs) if spec.mounted else tuple(laid))
    return rigs
