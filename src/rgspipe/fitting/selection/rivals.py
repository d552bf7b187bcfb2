"""Whether clearly different lights explain a target as well as the answer does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

from rgspipe.fitting.findings import Rival
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.options import RivalOptions, SearchOptions
from rgspipe.fitting.search.compare import (
    best_state,
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


def rival_polished(refiner: Refiner, best: State, others: Sequence[State], options: SearchOptions) -> State | None:
    """The nearest of other minima clearly apart from an answer that explains as much.

    Args:
        refiner: on the problem that the answer was polished on.
        others: polished on all pixels, too, with the exposures of the answer.
    """
    size = refiner.region.size
    for other in sorted(others, key=lambda state: rig_distance(best.emitters, state.emitters, size)):
        clear = rig_distance(best.emitters, other.emitters, size) > options.certainty.doubtful
        if clear and as_good(refiner, best, other, options.rivals):
            return other
    return None


def as_good_nearby(refiner: Refiner, best: State, others: Sequence[State], options: SearchOptions) -> list[State]:
    """The other minima that explain as much as an answer, but are not clearly apart from it.

    Args:
        refiner, others: as for `rival_polished`.
    """
    size = refiner.region.size
    _, *apart = distinct([best, *others], options.schedule.met, size)
    near = (one for one in apart if rig_distance(best.emitters, one.emitters, size) <= options.certainty.doubtful)
    return [other for other in near if as_good(refiner, best, other, options.rivals)]


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
