"""Whether clearly different lights explain a target as well as the answer does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

from rgspipe.fitting.certainty.regions import inside
from rgspipe.fitting.findings import Rival
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.options import RivalOptions, SearchOptions
from rgspipe.fitting.search.compare import (
    best_state,
    counterparts,
    distinct,
    drop,
    energy_shares,
    rig_distance,
    robust_costs,
    robust_losses,
)
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN, ROBUST
from rgspipe.machine.sums import average, total


def rival_among(refiner: Refiner, best: State, others: Sequence[State], options: SearchOptions) -> State | None:
    """One of the `others` that may be another answer, if there is one; those that come near are refined first."""
    problem, apart, size = refiner.problem, options.certainty.doubtful, refiner.region.size
    rivals = [state for state in others if rig_distance(state.emitters, best.emitters, size) > apart]
    if not rivals:
        return None
    rival = best_state(problem, rivals)
    if drop(problem, rival, best) > options.bar.least_faint:
        return None
    steps = options.schedule.steps
    one, other = (refiner.refined(state, ROBUST, 2 * steps) for state in (best, rival))
    met = rig_distance(one.emitters, other.emitters, size) <= apart
    if met or not equally_good(problem, one, other, options.rivals):
        return None
    # The answer is one of plain squares, so a rival has to be one, too.
    other = refiner.refined(other, PLAIN, steps)
    clear = rig_distance(best.emitters, other.emitters, size) > apart
    return other if clear and leaves_as_little(refiner, best, other, options.rivals) else None


def rival_polished(
    refiner: Refiner, best: State, others: Sequence[State], covariance: Sequence[Tensor], options: SearchOptions
) -> State | None:
    """The nearest of other minima that explains as much as an answer, clearly apart or not held by its regions.

    A covariance knows of one minimum. Another that explains as much is another answer, however near, unless the regions
    of the first are wide enough for both.

    Args:
        refiner: on the problem that the answer was polished on.
        others: polished on all pixels, too, with the exposures of the answer.
        covariance: of each light of the answer, see `FitResult.covariance`.
    """
    size = refiner.region.size
    _, *apart = distinct([best, *others], options.schedule.met, size)
    for other in sorted(apart, key=lambda state: rig_distance(best.emitters, state.emitters, size)):
        clear = rig_distance(best.emitters, other.emitters, size) > options.certainty.doubtful
        told = clear or not _regions_hold(best, other, covariance, size)
        if told and as_good(refiner, best, other, options.rivals):
            return other
    return None


def rival_elsewhere(
    refiner: Refiner, best: State, covariance: Sequence[Tensor], options: SearchOptions
) -> State | None:
    """The rig with a light whose place is not determined, if it explains as much from a clearly different one.

    A search meets such rivals only by chance: where its starts end in a valley without a floor is up to the last bits.

    Args:
        refiner: on the problem that the answer was polished on.
        covariance: of each light, see `FitResult.covariance`; infinite where nothing is determined.
    """
    for other in _moved(refiner, best, covariance, options):
        if as_good(refiner, best, other, options.rivals):
            return other
    return None


def _regions_hold(best: State, other: State, covariance: Sequence[Tensor], size: float) -> bool:
    """Whether the regions around the lights of an answer hold those of another rig."""
    one, two = zip(*counterparts(best.emitters, other.emitters, size), strict=True)
    order = [next(k for k, emitter in enumerate(best.emitters) if emitter is first) for first in one]
    spreads = [first.light.standing_spread(covariance[k], size) for first, k in zip(one, order, strict=True)]
    places = ([emitter.light.standing(size) for emitter in rig] for rig in (one, two))
    return inside(*places, spreads)


def told_rival(refiner: Refiner, best: State, other: State) -> Rival:
    """That `other` explains as much as an answer."""
    distance = rig_distance(best.emitters, other.emitters, refiner.region.size)
    return Rival(distance if math.isfinite(distance) else None)


def _moved(refiner: Refiner, best: State, covariance: Sequence[Tensor], options: SearchOptions) -> Iterator[State]:
    """The rig with one light moved along an axis, of those that are there and whose place is not determined."""
    apart = options.certainty.doubtful * refiner.region.size
    steps = apart * torch.cat([torch.eye(3), -torch.eye(3)]).double()
    for index, share in enumerate(energy_shares(best)):
        if share >= options.bar.least_energy and bool(torch.isinf(covariance[index].diagonal()[:3]).any()):
            for place in best.emitters[index].position + steps:
                rig = [*best.emitters]
                rig[index] = rig[index].placed(place)
                if torch.equal(refiner.region.clip(place), place):
                    yield refiner.start(rig, PLAIN)


def as_good(refiner: Refiner, best: State, other: State, options: RivalOptions) -> bool:
    """Whether `other` explains the target as well as `best` by either loss."""
    return equally_good(refiner.problem, best, other, options) and leaves_as_little(refiner, best, other, options)


def leaves_as_little(refiner: Refiner, best: State, other: State, options: RivalOptions) -> bool:
    """Whether `other` leaves about as little of the energy unexplained as `best`, or nothing but rounding."""
    return refiner.unexplained(other) <= options.energy * max(refiner.unexplained(best), ROUNDING**2)


def equally_good(problem: LightProblem, best: State, other: State, options: RivalOptions) -> bool:
    """Whether `other` explains the target as well as `best`, within the spread of what both leave unexplained."""
    one, two = robust_losses(problem, [best, other])
    least, cost = robust_costs(problem, [best, other])
    errors = max(1.0, float(total((problem.model.counts.cpu() / options.pixels_per_error).clamp(max=1.0))))
    return cost - least <= options.deviations * _deviation(two - one) / math.sqrt(errors)


def _deviation(values: Tensor) -> float:
    """Standard deviation of (P,) values."""
    return math.sqrt(float(total((values - average(values)).square())) / max(1, len(values) - 1))
