"""Other minima beside an answer: what starts that stand far apart may have stepped over.

Where a shadow's edge decides, neighbouring minima are nearer than any two starts, and differ in what is least sure. So
the loss is followed both ways along that, as far as starts are apart, and where it falls again behind a rise lights are
refined from there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import takewhile

import torch
from torch import Tensor

from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import distinct
from rgspipe.fitting.search.moves import moved_rig
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import EmitterRig
from rgspipe.fitting.search.weighting import PLAIN


def settled_beside(
    refiner: Refiner, answer: State, options: SearchOptions, blocks: Refiner | None = None
) -> tuple[State, tuple[State, ...]]:
    """The least minimum that is reached from the answer by going to ever better ones beside, and those beside it.

    Args:
        blocks: on the blocks of the same fit, if `refiner` is on pixels, which take long: they are asked only as far as
            blocks leave about as little as at the answer.
    """
    if answer.status is FitStatus.MAX_ITERATIONS:  # what is no minimum has none beside it
        return answer, ()
    best, *others = minima_beside(refiner, answer, options, blocks)
    if best is answer:
        return answer, tuple(others)
    return settled_beside(refiner, best, options, blocks)


def minima_beside(
    refiner: Refiner, answer: State, options: SearchOptions, blocks: Refiner | None = None
) -> list[State]:
    """The answer, and the minima of plain squares beside it that are not on their way to it; best first."""
    met, size = options.schedule.met, refiner.region.size
    steps = options.schedule.steps if blocks is None else options.iterations
    direction, most = _least_sure(refiner, answer), math.inf
    if blocks is not None:
        most = options.rivals.energy * _left_of(blocks, answer.emitters)
    found = [answer]
    for side in (1.0, -1.0):
        rigs: Iterable[EmitterRig] = _walk(refiner, answer, side * direction, options)
        if blocks is not None:
            rigs = takewhile(lambda rig: _left_of(blocks, rig) <= most, rigs)
        walked = [_walked(refiner, rig, answer) for rig in rigs]
        behind = _behind_a_rise([refiner.unexplained(state) for state in (answer, *walked)])
        if behind:
            found.append(refiner.refined(walked[behind - 1], PLAIN, steps))
    return sorted(distinct(found, met, size), key=refiner.unexplained)


def _walked(refiner: Refiner, rig: EmitterRig, answer: State) -> State:
    state = refiner.start(rig, PLAIN, answer)
    refiner.meter.course.piece()
    return state


def _left_of(blocks: Refiner, rig: EmitterRig) -> float:
    return blocks.unexplained(blocks.start(rig, PLAIN))


def _walk(refiner: Refiner, answer: State, direction: Tensor, options: SearchOptions) -> Iterator[EmitterRig]:
    """The lights moved along a direction in steps, as far as starts are apart."""
    step = options.schedule.met
    for count in range(1, 1 + steps_aside(options)):
        yield moved_rig(answer.emitters, count * step * direction, refiner.region)


def steps_aside(options: SearchOptions) -> int:
    """How many steps the loss is followed each way at most."""
    return round(options.combinations.separation / options.schedule.met)


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
