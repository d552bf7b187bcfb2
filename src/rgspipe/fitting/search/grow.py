"""Lights with an extent, and lights that hang on surfaces: found as free points, then grown, and hung."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import torch

from rgspipe.errors import InputError
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.mount import Mount
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import distinct, drop, ranked
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.rig_search import FoundRigs
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.spec import LightSpec
from rgspipe.scene import Light
from rgspipe.scene.walls import walls_near

#: Starts that are refined, of all that are tried: sizes of clearly different rigs, as they were found and as they lie
#: on surfaces; turns of a measured table.
STARTS = 2

#: Walls that a light may lie on are looked for among so many that are nearest to where a point explains most.
WALLS = 3


def grown(refiner: Refiner, found: FoundRigs, spec: LightSpec, options: SearchOptions) -> FoundRigs:
    """What was found, with lights that have an extent, or hang on surfaces, in the place of others."""
    problem, size = refiner.problem, refiner.region.size
    near = [one for one in found.others if drop(problem, one, found.best) < options.bar.least]
    rigs = [
        tuple(rig)
        for state in distinct([found.best, *ranked(problem, near)], options.certainty.doubtful, size)
        for sized in _sizes(spec, size)
        for rig in zip(*(laid(refiner, one, sized or one.light, spec) for one in state.emitters), strict=False)
    ]
    states = best_of_starts(refiner, rigs, options.schedule.steps)
    best = min(states, key=refiner.unexplained)
    return FoundRigs(best, tuple(states), {len(best.emitters): best})


def best_of_starts(refiner: Refiner, rigs: Sequence[Sequence[Emitter]], steps: int) -> list[State]:
    """The rigs that look best, after some steps each."""
    starts = sorted((refiner.start(rig, PLAIN) for rig in rigs), key=refiner.unexplained)[:STARTS]
    return [refiner.refined(start, PLAIN, steps) for start in starts]


def _sizes(spec: LightSpec, size: float) -> Sequence[Light | None]:
    """Lights to put in the place of those that were found; None for these themselves."""
    if not spec.extended:
        return (None,)
    return spec.kinds[-1].grown(size, spec.shape_free)


def laid(refiner: Refiner, one: Emitter, light: Light, spec: LightSpec) -> list[Emitter]:
    """A light in the place of another: there, on surfaces nearby if it may lie on them, and only there if it must.

    Raises:
        InputError: it is known to hang on a ceiling, and nothing faces down.
    """
    free, size = spec.free(light), refiner.region.size
    light = light.in_place_of(one.light)
    found = [] if spec.mounted else [Emitter.of(light, free)]
    if not (spec.mounted or light.flush):
        return found
    down = torch.tensor([0.0, 0.0, -1.0]) if spec.mount == "ceiling" else None
    walls = walls_near(refiner.problem.views.frozen.surfels, one.position, size, WALLS, down)
    if spec.mounted and not walls:
        remedy = "Look for lights on any surface, or free ones."
        raise InputError("mount", expected="a surface that faces down", found="none in the scene", remedy=remedy)
    mounts = [Mount(wall, spec.distance_of(light)) for wall in walls]
    there = [Emitter.of(mount.hung(light, one.position, size), free) for mount in mounts]
    pairs = zip(there, mounts, strict=True)
    return found + [replace(emitter, mount=mount) if spec.mounted else emitter for emitter, mount in pairs]
