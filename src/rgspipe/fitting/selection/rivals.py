"""Whether clearly different lights explain a target as well as the answer does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.compare import best_state, drop, rig_distance, robust_losses
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
        steps: of either rig under the robust loss, and half as many of the rival by plain squares.
    """

    apart: float = 0.05
    far: float = 0.5
    deviations: float = 2.0
    pixels_per_error: float = 25.0
    energy: float = 1.5
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
    return clear and refiner.unexplained(other) <= options.energy * refiner.unexplained(best)


def equally_good(problem: LightProblem, best: State, other: State, options: RivalOptions | None = None) -> bool:
    """Whether `other` explains the target as well as `best`, within the spread of what both leave unexplained."""
    options = options or RivalOptions()
    one, two = robust_losses(problem, [best, other])
    difference = two - one
    errors = max(1.0, float((problem.pixels_each / options.pixels_per_error).clamp(max=1.0).sum()))
    return float(difference.mean()) <= options.deviations * float(difference.std()) / math.sqrt(errors)
