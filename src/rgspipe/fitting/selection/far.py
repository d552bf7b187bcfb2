"""A sun in the place of a light, and a point in that of a sun.

From far enough away a point lights a scene as a sun does, which has one unknown less: only the image can tell which of
them a light is.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.moves import Region
from rgspipe.fitting.search.promise import comes_near
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import Candidates, EmitterRig
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.scene import Light, PointLight


def far_or_near(
    refiner: Refiner, candidates: Sequence[Candidates], answer: State, index: int, options: SearchOptions
) -> list[State]:
    """Refined rigs with suns in the place of light `index`, or with a point in the place of one that is a sun.

    A sun is refined only if a step of first order brings it near to the answer: in a room, where lamps light surfaces
    that face each other, none comes near.

    Args:
        candidates: of all kinds of light; without those of suns, no rig has one.
    """
    light = answer.emitters[index].light
    if light.distant:
        tried = [_farthest_point(refiner.region, light)]
    else:
        tried = _suns(refiner, candidates, answer, index, max(1, options.starts // 2))
    starts = [refiner.start(_with(answer, index, one), PLAIN, answer) for one in tried]
    near = [one for one in starts if light.distant or comes_near(refiner, answer, one, options.bar.least)]
    return [refiner.refined(start, PLAIN, options.iterations) for start in near]


def _farthest_point(region: Region, sun: Light) -> Emitter:
    """A point where a sun is, as far away as lights are looked for."""
    axis = torch.nn.functional.normalize(sun.axis, dim=0)
    reach = float((0.5 * (region.upper - region.lower) / axis.abs()).min())
    return Emitter.of(PointLight.shaped().at(0.5 * (region.lower + region.upper) - reach * axis))


def _suns(refiner: Refiner, candidates: Sequence[Candidates], answer: State, index: int, tries: int) -> list[Emitter]:
    """Those that explain most beside the other lights, clearly different ones."""
    others = State((*answer.emitters[:index], *answer.emitters[index + 1 :]), (), answer.intensity)
    size, found = refiner.region.size, []
    for suns in (one for one in candidates if one.coarse.shapes[0].distant):
        rigs = suns.extended(others, tries, size) if others.emitters else suns.rigs(1, tries, size)
        found += [rig[-1] for rig in rigs]
    return found


def _with(answer: State, index: int, emitter: Emitter) -> EmitterRig:
    return (*answer.emitters[:index], emitter, *answer.emitters[index + 1 :])
