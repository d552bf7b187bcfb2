"""Other minima beside an answer: what starts that stand far apart may have stepped over.

Where a shadow's edge decides, neighbouring minima are nearer than any two starts, and differ in what is least sure. So
the loss is followed both ways along that, as far as starts are apart, and where it falls again behind a rise lights are
refined from there.
"""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor

from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import distinct
from rgspipe.fitting.search.moves import moved_rig
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN


def minima_beside(refiner: Refiner, answer: State, options: SearchOptions) -> list[State]:
    """The answer, and the minima of plain squares beside it that are not on their way to it; best first."""
    steps, met, size = options.schedule.steps, options.schedule.met, refiner.region.size
    found = [answer, *(refiner.refined(start, PLAIN, steps) for start in _starts(refiner, answer, options))]
    return sorted(distinct(found, met, size), key=refiner.unexplained)


def settled_beside(refiner: Refiner, answer: State, options: SearchOptions) -> tuple[State, tuple[State, ...]]:
    """The least minimum that is reached from the answer by going to ever better ones beside, and those beside it."""
    best, *others = minima_beside(refiner, answer, options)
    if best is answer:
        return answer, tuple(others)
    return settled_beside(refiner, best, options)


def _starts(refiner: Refiner, answer: State, options: SearchOptions) -> Iterator[State]:
    """On either side of the answer the best place of those behind a rise of the loss."""
    direction = _least_sure(refiner, answer)
    count = round(options.combinations.separation / options.schedule.met)
    for side in (1.0, -1.0):
        steps = side * options.schedule.met * torch.arange(1, count + 1).double()
        rigs = [moved_rig(answer.emitters, step * direction, refiner.region) for step in steps]
        walked = [refiner.start(rig, PLAIN, answer) for rig in rigs]
        behind = _behind_a_rise([refiner.unexplained(state) for state in (answer, *walked)])
        if behind:
            yield walked[behind - 1]


def _behind_a_rise(losses: list[float]) -> int:
    """Index of the least of the losses that are less than the one before; 0 if they rise all the way."""
    falling = [k for k in range(1, len(losses)) if losses[k] < losses[k - 1]]
    return min(falling, key=losses.__getitem__, default=0)


def _least_sure(refiner: Refiner, answer: State) -> Tensor:
    """(D,) change of the parameters of all lights, by one size of the scene or rad, that plain squares tell least."""
    matrix = refiner.normal(answer, PLAIN).matrix
    direction = torch.linalg.eigh(matrix.double().cpu()).eigenvectors[:, 0]
    parts = direction.split([emitter.parameters for emitter in answer.emitters])
    pairs = zip(answer.emitters, parts, strict=True)
    return direction / max(max(emitter.stretch(part)) for emitter, part in pairs)
