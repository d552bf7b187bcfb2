"""Whether clearly different lights explain a target as well as the answer does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.search.compare import (
    best_state,
    drop,
    energy_shares,
    rig_distance,
    robust_costs,
    robust_losses,
)
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN, ROBUST


@dataclass(frozen=True)
class RivalOptions:
    """What counts as another answer.

    Attributes:
        apart: rigs are clearly different where a light is farther from its counterpart than this part of the scene's
            size, or where their numbers differ.
        far: a rival is refined, to see whether it is as good, unless the best rig's robust cost is lower by this share.
        deviations: standard deviations between losses within which two rigs are equally good.
        pixels_per_error: errors of about so many neighbouring pixels are one: what the model gets wrong is smooth.
        energy: a rival leaves at most so many times the energy unexplained that the best rig does.
        stride, least_energy: where the place of a light is not determined that sends this share of the image's energy,
            others are tried so many times `apart` away.
        steps: of either rig under the robust loss, and half as many of the rival by plain squares.
    """

    apart: float = 0.05
    far: float = 0.5
    deviations: float = 2.0
    pixels_per_error: float = 25.0
    energy: float = 1.5
    stride: float = 1.2
    least_energy: float = 0.01
    steps: int = 12


def has_rival(refiner: Refiner, best: State, others: Sequence[State], options: RivalOptions | None = None) -> bool:
    """Whether one of the `others` is another answer; those that come near are refined first."""
    options = options or RivalOptions()
    problem, apart = refiner.problem, options.apart * refiner.region.size
    rivals = [state for state in others if rig_distance(state.emitters, best.emitters) > apart]
    if not rivals:
        return False
    rival = best_state(problem, rivals)
    if drop(problem, rival, best) > options.far:
        return False
    one, other = (refiner.refined(state, ROBUST, options.steps) for state in (best, rival))
    if rig_distance(one.emitters, other.emitters) <= apart or not equally_good(problem, one, other, options):
        return False
    # The answer is one of plain squares, so a rival has to be one, too.
    other = refiner.refined(other, PLAIN, options.steps // 2)
    clear = rig_distance(best.emitters, other.emitters) > apart
    return clear and _leaves_as_little(refiner, best, other, options)


def stands_anywhere(
    refiner: Refiner, best: State, covariance: Sequence[Tensor], options: RivalOptions | None = None
) -> bool:
    """Whether a light whose place is not determined explains as much from a clearly different one.

    A search meets such rivals only by chance: where its starts end in a valley without a floor is up to the last bits.

    Args:
        refiner: on the problem that the answer was polished on.
        covariance: of each light, see `FitResult.covariance`; infinite where nothing is determined.
    """
    options = options or RivalOptions()
    return any(
        equally_good(refiner.problem, best, other, options) and _leaves_as_little(refiner, best, other, options)
        for other in _moved(refiner, best, covariance, options)
    )


def _moved(refiner: Refiner, best: State, covariance: Sequence[Tensor], options: RivalOptions) -> Iterator[State]:
    """The rig with one light moved along an axis, of those that are there and whose place is not determined."""
    apart = options.apart * refiner.region.size
    steps = options.stride * apart * torch.cat([torch.eye(3), -torch.eye(3)]).double()
    for index, share in enumerate(energy_shares(best)):
        if share >= options.least_energy and bool(torch.isinf(covariance[index].diagonal()[:3]).any()):
            for place in refiner.region.clip(best.emitters[index].position + steps):
                rig = [*best.emitters]
                rig[index] = rig[index].placed(place)
                if rig_distance(rig, best.emitters) > apart:
                    yield refiner.start(rig, PLAIN)


def _leaves_as_little(refiner: Refiner, best: State, other: State, options: RivalOptions) -> bool:
    """Whether `other` leaves about as little of the energy unexplained as `best`, or nothing but rounding."""
    return refiner.unexplained(other) <= options.energy * max(refiner.unexplained(best), ROUNDING**2)


def equally_good(problem: LightProblem, best: State, other: State, options: RivalOptions | None = None) -> bool:
    """Whether `other` explains the target as well as `best`, within the spread of what both leave unexplained."""
    options = options or RivalOptions()
    one, two = robust_losses(problem, [best, other])
    least, cost = robust_costs(problem, [best, other])
    errors = max(1.0, float((problem.pixels_each / options.pixels_per_error).clamp(max=1.0).sum()))
    return cost - least <= options.deviations * float((two - one).std()) / math.sqrt(errors)
