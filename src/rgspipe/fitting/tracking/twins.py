"""Lights that stand close together: a search that took two of them for one is mended by splitting the strong one.

Two headlights make about the image of one light between them. A search with a coarse grid of candidates finds that one,
and a second light somewhere that explains some of the rest; from there the true pair is uphill. So the strongest lights
are split into two halves, in the place of the faintest one, along several directions, and the best of all that goes on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import torch

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.schedule import refined_starts
from rgspipe.fitting.search.starts import EmitterRig
from rgspipe.fitting.search_lm import fit_from
from rgspipe.renderer.images.model import ImageModel
from rgspipe.scene.lights.coordinates import tangents


def split_lights(
    problem: LightProblem,
    result: FitResult,
    blocks: ImageModel | None,
    search: SearchOptions | None = None,
) -> FitResult:
    """The result, or one with a light split in two in the place of its faintest if that explains clearly more.

    Args:
        problem: of all pixels.
        blocks: the views as blocks of pixels, on which split rigs are refined.
        search: how split rigs are refined and polished. The halves of a light are put as far apart as two answers are.
    """
    search = search or SearchOptions()
    if len(result.lights) < 2:
        return result
    coarse = Refiner.of(problem.coarsest(blocks))
    rigs = split_rigs(result, search.certainty.doubtful * coarse.region.size)
    states = refined_starts(coarse, rigs, search.iterations, search.schedule)
    best = sorted(states, key=coarse.unexplained)[: max(1, search.starts // 2)]
    polished = [fit_from(problem, state.emitters, search.iterations, search) for state in best]
    best = min(polished, key=lambda other: other.loss)
    # Below rounding no rig is the better one.
    left, before = (max(one.loss, ROUNDING**2) for one in (best, result))
    chosen = best if left < (1.0 - search.bar.least) * before else result
    return replace(
        chosen,
        seconds=result.seconds + coarse.meter.seconds,
        evaluations=result.evaluations + coarse.meter.evaluations + sum(one.evaluations for one in polished),
        iterations=result.iterations + coarse.meter.iterations + sum(one.iterations for one in polished),
    )


def split_rigs(result: FitResult, apart: float) -> list[EmitterRig]:
    """The rig with one light after the other split in the place of the faintest, three ways, `apart` scene units."""
    emitters = [Emitter.of(light) for light in result.lights]
    strengths = [float(light.intensity.mean()) for light in result.lights]
    faint = min(range(len(strengths)), key=strengths.__getitem__)
    rigs = []
    for index, emitter in enumerate(emitters):
        if index == faint:
            continue
        for direction in _directions(emitter):
            half = 0.5 * apart * direction
            halves = [emitter.placed(emitter.position + sign * half) for sign in (1.0, -1.0)]
            others = [one for k, one in enumerate(emitters) if k not in (index, faint)]
            rigs.append((*halves, *others))
    return rigs


def _directions(emitter: Emitter) -> Sequence[torch.Tensor]:
    """Along which a light is split: across its axis, in four directions, and along it; of a point light the axes."""
    if emitter.axis is None:
        return list(torch.eye(3, dtype=torch.float64))
    one, other = tangents(emitter.axis)
    turned = [(one + other) / 2.0**0.5, (one - other) / 2.0**0.5]
    return [one, other, *turned, emitter.axis]
