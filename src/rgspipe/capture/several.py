"""Several captures of one room under different lamps, which share its albedo; and one with the lamps off.

Given the lamps of all other captures, what these measured of the albedo is known: it is Gaussian, of the precision and
the mean

    K = Σ_o D_o ,    μ = (Q + K)⁻¹ Σ_o D_o (log L_o − log ρ̂ − log d_o) ,

and is to the lamps of one capture what a predicted albedo is, with its own doubt. So captures are fitted in turns, each
beside what the others say.

Light adds up: what a capture shows less what one with the lamps off shows, from the same surfaces, is what a capture of
the lamps alone would show, whatever else shines.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from rgspipe.capture.factors import Factors
from rgspipe.capture.lamps import LampProblem
from rgspipe.capture.radiance import Measured
from rgspipe.capture.search import FoundLamps, Tried

#: Rounds in which each capture is fitted beside the others.
ROUNDS = 2

#: What is left once the lamps are off counts from this part of what was there: the rest is noise.
LEAST_LEFT = 0.02


def found_in_turns(
    problems: Sequence[LampProblem], search: Callable[[LampProblem, int], FoundLamps]
) -> list[FoundLamps]:
    """The lamps of each capture, which `search` finds by its number, beside what the others tell of the albedo."""
    answers = [search(problem, own) for own, problem in enumerate(problems)]
    for _ in range(ROUNDS if len(problems) > 1 else 0):
        for own, problem in enumerate(problems):
            others = [answer.best for other, answer in enumerate(answers) if other != own]
            answers[own] = search(informed(problem, others), own)
    return answers


def informed(problem: LampProblem, others: Sequence[Tried]) -> LampProblem:
    """The problem of one capture with what the lamps of others make of the albedo."""
    precision, weighted = np.zeros((len(problem.radiance), 1)), np.zeros_like(problem.radiance)
    for other in others:
        weight = np.stack([own.weight for own in other.problem.field.channels], axis=1)
        log_albedo = np.log(other.problem.radiance) - np.log(other.problem.arriving(other.lamps))
        precision = precision + weight
        weighted += weight * (log_albedo - np.log(problem.predicted))
    known = others[0].problem.field
    parts = zip(precision.T, np.split(weighted, precision.shape[1], axis=1), strict=True)
    mean = [Factors((known.precision + sp.diags(own)).tocsc()).solve(part) for own, part in parts]
    predicted = problem.predicted * np.exp(np.concatenate(mean, axis=1))
    precision = precision if precision.shape[1] == 3 else precision[:, 0]
    field = replace(problem.field, variances=known.variances, rough=known.rough, known=precision)
    return replace(problem, predicted=predicted, field=field, prediction=None)


def without(capture: Measured, off: Measured) -> Measured:
    """What is left of a capture once what shines with the lamps off is taken away; both of one exposure."""
    left = capture.radiance - off.radiance
    grey = np.maximum(left.mean(axis=1), 1e-300)
    squared = capture.variance * capture.radiance.mean(axis=1) ** 2 + off.variance * off.radiance.mean(axis=1) ** 2
    plain = (left > LEAST_LEFT * capture.radiance).all(axis=1) & np.isfinite(squared)
    plain &= ~off.blown_out.any(axis=1)
    seen = np.where(plain, np.minimum(capture.seen, off.seen), 0.0)
    middle = np.median(left[plain], axis=0) if plain.any() else np.ones(3)
    radiance = np.where(plain[:, None], left, np.maximum(middle, 1e-300))
    variance = np.divide(squared, grey**2, out=np.full_like(squared, np.inf), where=plain)
    return replace(capture, radiance=radiance, variance=variance, seen=seen)
