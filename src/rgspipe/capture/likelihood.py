"""Lamps with what belongs to them: the variances and the albedo of the unseen that they make likely, and −2 log p.

Each place of lamps makes other variances likely. By those of one place any other looks worse, so that lamps are
compared once each has its own, by what belongs to either, both together. How sure a comparison is follows from the
parts of the scene, whose errors are their own: by how many draws of as many parts, some of them twice and some not at
all, a side is the likelier one (the bootstrap of Efron 1979).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rgspipe.capture.bounds import with_bounds
from rgspipe.capture.doubts import model_variance
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.side_by_side import side_by_side
from rgspipe.capture.variances import with_likely_variances
from rgspipe.training.albedo import ALBEDO_RANGE

#: Steps of lamps that nearly stand where they belong.
STEPS = 25

#: Rounds in which outliers, variances and the albedo of the unseen follow from the lamps and these from them.
ROUNDS = 3

#: Draws of the scene's parts, which tell a chance of 1 in 100 to a sixth of it.
DRAWS = 4096


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

    @classmethod
    def settled_if(cls, problem: LampProblem, lamps: Lamps, wanted: Callable[[Lamps], bool]) -> Tried | None:
        """The same; None as soon as they come to where they are not `wanted`."""
        for _ in range(ROUNDS):
            problem, lamps = settled_once(problem, lamps)
            if not wanted(lamps):
                return None
        return cls.of(problem, lamps)

    def put_by(self) -> Tried:
        """The same without what is large and can be made again."""
        problem = self.problem
        fresh = replace(problem, field=replace(problem.field), received=replace(problem.received))
        return replace(self, problem=fresh)

    def costs_less(self, lamps: Lamps) -> Comparison:
        """How much likelier these lamps are than others by what belongs to these."""
        return Comparison(np.bincount(self.problem.parts, self.problem.costs(lamps) - self.problem.costs(self.lamps)))

    def over(self, other: Tried) -> Comparison:
        """How much likelier these settled lamps are than others, by what belongs to either, both together."""
        theirs, ours = side_by_side(
            lambda of: of[0].refined(of[0].lamps(of[1].places, of[1].logs), STEPS),
            [(other.problem, self.lamps), (self.problem, other.lamps)],
        )
        gains = self.problem.costs(ours) - self.problem.costs(self.lamps)
        gains += other.problem.costs(other.lamps) - other.problem.costs(theirs)
        return Comparison(np.bincount(self.problem.parts, gains))


@dataclass(frozen=True, eq=False)
class Comparison:
    """How much likelier some lamps are than others.

    Attributes:
        gains: (B,) of −2 log p by parts of the scene, positive where they are likelier.
    """

    gains: Numbers

    @property
    def gain(self) -> float:
        """Of the whole scene."""
        return float(self.gains.sum())

    @property
    def turned(self) -> Comparison:
        """How much likelier the others are."""
        return Comparison(-self.gains)

    @property
    def doubt(self) -> float:
        """Part of the draws of the scene's parts by which the others are likelier."""
        return float(chances([self])[1])


def chances(compared: Sequence[Comparison]) -> Numbers:
    """(1 + K,) parts of the draws of the scene's parts by which some lamps are the likeliest, and each of K others that
    they were compared with.
    """
    if not compared:
        return np.ones(1)
    gains = np.stack([one.gains for one in compared], axis=1)
    count, others = gains.shape
    drawn = np.random.default_rng(0).multinomial(count, np.full(count, 1.0 / count), DRAWS)
    left = np.concatenate([np.zeros((DRAWS, 1)), drawn @ gains], axis=1)
    return np.bincount(left.argmin(axis=1), minlength=1 + others) / DRAWS
