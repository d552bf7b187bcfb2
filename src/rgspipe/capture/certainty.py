"""How sure the lamps of a capture are, with errors that neighbouring surfels share.

The likelihood takes what is measured at two surfels for independent, apart from the albedo. Errors of the gather, of
shadows' edges and of the geometry are not: they are those of a corner or of a wall. So the lamps are fitted again
without each of B parts of the scene, and what they vary by is what they are known to (the jackknife of Quenouille and
Tukey, with blocks as Künsch 1989 has them), beside what the likelihood knows:

    C = (Jᵀ Σ⁻¹ J)⁻¹ + (B − 1)/B Σ_b (θ_b − θ̄)(θ_b − θ̄)ᵀ ,

beside what the model of light lacks as a whole (`capture.shared_errors`), what the lamps would move by if another
minimum beside were theirs, as likely as the scene's parts leave that, or if the one more that was not believed were
there after all, as far as it came towards being believed, and to no place better than surfels resolve light.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rgspipe.capture.lamps import NUMBERS, LampProblem, Lamps
from rgspipe.capture.minima import LIKELY
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.search import FoundLamps
from rgspipe.capture.shared_errors import shared_covariance
from rgspipe.capture.side_by_side import side_by_side
from rgspipe.fitting.certainty.regions import quantile
from rgspipe.scene.grade import TIED

#: Steps of the lamps without one of the scene's parts.
STEPS = 6


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is not known of K lamps.

    Attributes:
        places: (K, 3, 3) covariance, scene units².
        gains: (K, 3) standard deviations of the logarithms of the intensities.
        scale: that of all intensities together; the albedo has the same, the other way round.
        bounced: part of the light on what was seen that other surfaces send there: what ties the scale down.
    """

    places: Numbers
    gains: Numbers
    scale: float
    bounced: float

    @classmethod
    def of(cls, answer: FoundLamps) -> Certainty:
        """Of lamps as they were fitted."""
        problem, lamps = answer.best.problem, answer.best.lamps
        covariance = _covariance(problem, lamps) + _rival_covariance(answer) + _number_covariance(problem, answer)
        count, size = len(lamps), problem.size
        numbers = covariance.reshape(count, NUMBERS, count, NUMBERS)
        own = numbers[np.arange(count), :, np.arange(count)]
        places = size**2 * own[:, :3, :3] + problem.resolved**2 * np.eye(3)
        every = np.zeros((count, NUMBERS))
        every[:, 3:] = 1.0 / (3 * count)
        scale = every.reshape(-1) @ covariance @ every.reshape(-1)
        used = problem.field.weight > 0.0
        arriving = problem.arriving(lamps)[used]
        bounced = float(np.median(problem.received.known[used] / arriving))
        gains = np.sqrt(np.diagonal(own[:, 3:, 3:], axis1=1, axis2=2))
        return cls(places, gains, float(np.sqrt(scale)), bounced)

    def spread(self, size: float) -> Numbers:
        """(K,) standard deviation of the distance of each lamp from where it is said to be, in parts of `size`."""
        return np.sqrt(np.trace(self.places, axis1=1, axis2=2)) / size

    @property
    def is_tied(self) -> bool:
        """Whether intensities and albedo are known, and not only their product."""
        return self.scale <= TIED


def _covariance(problem: LampProblem, lamps: Lamps) -> Numbers:
    """(6 K, 6 K) C of the lamps' numbers."""
    parts = problem.parts
    left = side_by_side(lambda part: _numbers(problem, _without(problem, lamps, parts == part)), np.unique(parts))
    found = np.stack(left)
    apart = found - found.mean(axis=0)
    resampled = (len(found) - 1) / len(found) * (apart.T @ apart)
    return problem.covariance(lamps) + resampled + shared_covariance(problem, lamps)


def _rival_covariance(answer: FoundLamps) -> Numbers:
    """(6 K, 6 K) of the lamps' numbers, by the other minima that they may belong to."""
    problem, lamps = answer.best.problem, answer.best.lamps
    own = _numbers(problem, lamps)
    moved = np.array([_numbers(problem, rival.tried.lamps) - own for rival in answer.rivals]).reshape(-1, len(own))
    chance = np.array([rival.chance for rival in answer.rivals])
    # The second moment of few that are far away would leave them out of the region.
    weight = np.where(chance > LIKELY, np.maximum(chance, 1.0 / quantile(1.0 - LIKELY, 3)), chance)
    return moved.T @ (moved * weight[:, None])


def _number_covariance(problem: LampProblem, answer: FoundLamps) -> Numbers:
    """(6 K, 6 K) of the lamps' numbers, by one more lamp that was not believed."""
    lamps = answer.best.lamps
    last = answer.compared[-1] if answer.compared else None
    if last is None or len(last.fewer.lamps) < len(lamps):
        return np.zeros((NUMBERS * len(lamps),) * 2)
    beside = last.more.lamps.at(range(len(lamps)))
    moved = _numbers(problem, beside) - _numbers(problem, lamps)
    return min(1.0, max(0.0, last.gain) / last.wanted) * np.outer(moved, moved)


def _without(problem: LampProblem, lamps: Lamps, left_out: np.ndarray) -> Lamps:
    """The lamps as they would be without the measurements that are `left_out` (N,) bool."""
    field = problem.field.trusted(np.where(left_out, 0.0, problem.field.trust))
    return replace(problem, field=field).refined(lamps, STEPS)


def _numbers(problem: LampProblem, lamps: Lamps) -> Numbers:
    """(6 K,) the lamps' numbers."""
    return np.concatenate([lamps.places / problem.size, lamps.logs], axis=1).reshape(-1)
