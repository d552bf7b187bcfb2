"""Whether clearly different lights explain a target as well as the answer does."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import RivalOptions
from rgspipe.fitting.search.compare import best_state, drop, rig_distance, robust_losses
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import PLAIN, ROBUST


def has_rival(refiner: Refiner, best: State, others: Sequence[State], options: RivalOptions) -> bool:
    """Whether one of the `others` is another answer; those that come near are refined first."""
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
    return clear and refiner.unexplained(other) <= options.energy * refiner.unexplained(best)


def equally_good(problem: LightProblem, best: State, other: State, options: RivalOptions) -> bool:
    """Whether `other` explains the target as well as `best`, within the spread of what both leave unexplained."""
    one, two = robust_losses(problem, [best, other])
    difference = two - one
    errors = max(1.0, float((problem.pixels_each / options.pixels_per_error).clamp(max=1.0).sum()))
    return float(difference.mean()) <= options.deviations * float(difference.std()) / math.sqrt(errors)
