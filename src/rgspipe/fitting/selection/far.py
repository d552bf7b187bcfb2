"""A sun in the place of a light, and a point in that of a sun.

From far enough away a point lights a scene as a sun does, which has one unknown less: which of them a light is, only the
image can tell.
"""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.promise import comes_near
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import refined_starts
from rgspipe.fitting.search.starts import Candidates, EmitterRig
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.scene import PointLight


def far_or_near(
    refiner: Refiner, candidates: Sequence[Candidates], answer: State, index: int, options: SearchOptions
) -> list[State]:
    """Refined rigs with a sun in the place of light `index`, or with a point in the place of one that is a sun.

    A sun is refined only if a step of first order brings it near to the answer; in a room, where lamps light what faces
    each other, none does.

    Args:
        candidates: of all kinds of light; without those of suns, no rig has one.
    """
    light, region = answer.emitters[index].light, refiner.region
    if light.distant:
        rigs = [_with(answer, index, Emitter.of(PointLight(region.clip(light.standing(region.size)), 1.0)))]
    else:
        starts = [
            refiner.start(_with(answer, index, sun), PLAIN, answer) for sun in _suns(refiner, candidates, answer, index, options)
        ]
        rigs = [one.emitters for one in starts if comes_near(refiner, answer, one, options.bar.least)]
    return refined_starts(refiner, rigs, options.iterations, options.schedule, answer) if rigs else []


def _suns(
    refiner: Refiner, candidates: Sequence[Candidates], answer: State, index: int, options: SearchOptions
) -> list[Emitter]:
    """Those that explain most beside the other lights, clearly different ones."""
    others = State((*answer.emitters[:index], *answer.emitters[index + 1 :]), (), answer.intensity)
    size, tries, found = refiner.region.size, max(1, options.starts // 2), []
    for suns in (one for one in candidates if one.coarse.shapes[0].distant):
        rigs = suns.extended(others, tries, size) if others.emitters else suns.rigs(1, tries, size)
        found += [rig[-1] for rig in rigs]
    return found


def _with(answer: State, index: int, emitter: Emitter) -> EmitterRig:
    return (*answer.emitters[:index], emitter, *answer.emitters[index + 1 :])
