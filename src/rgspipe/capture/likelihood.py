"""Lamps with what belongs to them: the variances and the albedo of the unseen that they make likely, and −2 log p.

Each place of lamps makes other variances likely. By those of one place any other looks worse, so that lamps are
compared once each has its own, by what belongs to either, both together. How sure a comparison is follows from the
parts of the scene, whose errors are their own: what each says for one side, and how differently they say it (the test
of Vuong 1989, with parts of the scene for its draws).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from rgspipe.capture.bounds import with_bounds
from rgspipe.capture.doubts import model_variance
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.variances import with_likely_variances
from rgspipe.training.albedo import ALBEDO_RANGE

#: Steps of lamps that nearly stand where they belong.
STEPS = 25

#: Rounds in which outliers, variances and the albedo of the unseen follow from the lamps and these from them.
ROUNDS = 3


def weighed(problem: LampProblem, lamps: Lamps | None) -> LampProblem:
    """The problem with what belongs to `lamps`: the albedo of the unseen, variances, and trust in the surfels."""
    problem, lamps = with_bounds(problem, lamps)
    measured = problem.pixels + model_variance(problem, lamps, problem.rays)
    problem = replace(problem, field=replace(problem.field, measured=measured))
    if lamps is None:
        return problem
    problem = problem.with_belief(lamps)
    albedo = np.clip(problem.albedo(lamps), *ALBEDO_RANGE)
    problem = replace(problem, received=problem.received.with_albedo(albedo))
    residual = problem.residual(problem.lamps(lamps.places, lamps.logs))
    return replace(problem, field=with_likely_variances(problem.field, residual, trusting=True))


def settled_once(problem: LampProblem, lamps: Lamps) -> tuple[LampProblem, Lamps]:
    """The problem with what belongs to `lamps`, and lamps where they belong by that."""
    problem = weighed(problem, lamps)
    return problem, problem.refined(problem.lamps(lamps.places, lamps.logs), STEPS)


@dataclass(frozen=True, eq=False)
class Tried:
    """Lamps of one number.

    Attributes:
        problem: with the variances that they make most likely.
        lamps: as fitted.
        deviance: −2 log p of what was measured.
    """

    problem: LampProblem
    lamps: Lamps
    deviance: float

    @classmethod
    def of(cls, problem: LampProblem, lamps: Lamps) -> Tried:
        """With the variances as they are most likely."""
        residual = problem.residual(lamps)
        field = with_likely_variances(problem.field, residual)
        return cls(replace(problem, field=field), lamps, field.deviance(residual))

    @classmethod
    def refined(cls, problem: LampProblem, lamps: Lamps) -> Tried:
        """The lamps where they belong by the surfels that `problem` trusts."""
        return cls.of(problem, problem.refined(problem.lamps(lamps.places, lamps.logs), STEPS))

    @classmethod
    def settled(cls, problem: LampProblem, lamps: Lamps) -> Tried:
        """The lamps where they belong by what belongs to them."""
        for _ in range(ROUNDS):
            problem, lamps = settled_once(problem, lamps)
        return cls.of(problem, lamps)

    def over(self, other: Tried) -> Comparison:
        """How much likelier these settled lamps are than others, by what belongs to either, both together."""
        theirs = other.problem.refined(other.problem.lamps(self.lamps.places, self.lamps.logs), STEPS)
        ours = self.problem.refined(self.problem.lamps(other.lamps.places, other.lamps.logs), STEPS)
        gains = self.problem.costs(ours) - self.problem.costs(self.lamps)
        gains += other.problem.costs(other.lamps) - other.problem.costs(theirs)
        return Comparison.of(np.bincount(self.problem.parts, gains))


@dataclass(frozen=True)
class Comparison:
    """How much likelier some lamps are than others.

    Attributes:
        gain: of −2 log p, positive where they are likelier.
        doubt: its standard deviation, if each part of the scene is a draw of its own.
    """

    gain: float
    doubt: float

    @classmethod
    def of(cls, gains: Numbers) -> Comparison:
        """Of gains (B,) by parts of the scene."""
        count = len(gains)
        return cls(float(gains.sum()), float(np.sqrt(count * gains.var(ddof=1))) if count > 1 else 0.0)

    @property
    def odds(self) -> float:
        """Of the others being likelier after all; at most 1, as such others would be the answer."""
        if self.gain <= 0.0 or self.doubt == 0.0:
            return float(self.gain <= 0.0)
        chance = float(ndtr(-self.gain / self.doubt))
        return chance / (1.0 - chance)
