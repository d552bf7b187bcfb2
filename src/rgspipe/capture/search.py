"""Where lamps may be: candidates all over the scene, ranked on surfels alone, and how many of them it takes.

A candidate beside the lamps that are known is ranked with the intensity that suits it, in one grey channel, by a few
steps of Gauss and Newton that all candidates take at once. The best are refined. One lamp more is there if it makes
what was measured so much more likely, with the variances of the albedo estimated anew for either number of lamps: a lamp
that is left out looks like paint, and the more of it there is to explain, the less is paint expected to change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rgspipe.capture.lamps import DARK, NUMBERS, LampProblem, Lamps
from rgspipe.capture.radiance import Numbers

#: Candidates that are refined, and least distance of two of them in parts of the scene's size.
TRIES, APART = 5, 0.14

#: Steps of candidates' intensities, and of lamps: at first and at last.
RANKING, FIRST, LAST = 5, 8, 25

#: Largest step of the logarithm of a candidate's intensity.
LONGEST_GAIN = 1.5

#: Candidates that are ranked at once.
BATCH = 128

#: Parts of −2 log p that one more lamp has to lower for each of its numbers and each e-fold of measurements (Schwarz
#: 1978 has 1). Errors of gather and geometry are not independent from surfel to surfel, as the likelihood has it.
WORTH = 4.0

#: Rounds in which outliers, variances and the albedo of the unseen follow from the lamps and these from them.
ROUNDS = 3

#: Error at which a surfel counts half, in medians of all.
OUTLIER = 3.0


@dataclass(frozen=True, eq=False)
class Candidates:
    """Places of lamps, and what a grey lamp at each sends to every surfel, T e.

    Attributes:
        places: (C, 3) scene units.
        shares: (N, C).
    """

    places: Numbers
    shares: Numbers

    @classmethod
    def of(cls, problem: LampProblem) -> Candidates:
        """Those of the scene's dictionary."""
        dictionary = problem.frozen.dictionary
        shares = problem.received.spread(dictionary.irradiance.double().cpu().numpy().T)
        return cls(dictionary.positions.double().numpy(), shares)


def ranked(problem: LampProblem, candidates: Candidates, known: Lamps | None) -> tuple[Numbers, Numbers]:
    """(C,) cost of one more grey lamp at each candidate, and (C,) the logarithm of its intensity over π."""
    target = problem.target.mean(axis=1)
    light = problem.received.known + (0.0 if known is None else known.arriving)
    light = np.maximum(np.exp(np.log(np.maximum(light, 1e-300)).mean(axis=1)), DARK * np.median(light))
    sent = np.exp(target) * 0.2
    costs, logs = [], []
    for begin in range(0, candidates.shares.shape[1], BATCH):
        shares = candidates.shares[:, begin : begin + BATCH]
        typical = np.array([np.median(column[column > 0.0]) if (column > 0.0).any() else 1.0 for column in shares.T])
        gain = np.log(np.median(sent) / np.maximum(typical, 1e-300))
        for _ in range(RANKING):
            own = shares * np.exp(gain)
            arriving = own + light[:, None]
            residual, slope = target[:, None] - np.log(arriving), own / arriving
            whitened = problem.field.whitened(slope)
            step = (whitened * residual).sum(axis=0) / np.maximum((whitened * slope).sum(axis=0), 1e-12)
            gain = gain + np.clip(step, -LONGEST_GAIN, LONGEST_GAIN)
        residual = target[:, None] - np.log(shares * np.exp(gain) + light[:, None])
        costs.append((residual * problem.field.whitened(residual)).sum(axis=0))
        logs.append(gain)
    return np.concatenate(costs), np.concatenate(logs)


def with_one_more(problem: LampProblem, candidates: Candidates, known: Lamps | None) -> Lamps:
    """The best lamps found that are one more than `known`."""
    costs, logs = ranked(problem, candidates, known)
    found = []
    for index in _best_apart(costs, candidates.places, APART * problem.size):
        place, log = candidates.places[index][None], np.full((1, 3), logs[index])
        places = place if known is None else np.concatenate([known.places, place])
        gains = log if known is None else np.concatenate([known.logs, log])
        lamps = problem.refined(problem.lamps(places, gains), FIRST)
        found.append((problem.cost(lamps), lamps))
    return problem.refined(min(found, key=lambda pair: pair[0])[1], LAST)


def _best_apart(costs: Numbers, places: Numbers, apart: float) -> list[int]:
    """The TRIES candidates of least cost that are apart from each other."""
    chosen: list[int] = []
    for index in np.argsort(costs):
        if all(np.linalg.norm(places[index] - places[other]) > apart for other in chosen):
            chosen.append(int(index))
        if len(chosen) == TRIES:
            break
    return chosen


def settled(problem: LampProblem, lamps: Lamps, rounds: int = ROUNDS) -> tuple[LampProblem, Lamps]:
    """With variances, outliers and the albedo of the unseen that belong to the lamps, and lamps that belong to these."""
    for _ in range(rounds):
        problem = _reweighted(problem, lamps)
        lamps = problem.refined(problem.lamps(lamps.places, lamps.logs), LAST)
    return problem, lamps


def _reweighted(problem: LampProblem, lamps: Lamps) -> LampProblem:
    residual = problem.residual(lamps)
    field = problem.field.fitted(residual)
    noise = np.abs(residual - field.mean(residual)).mean(axis=1)
    used = np.isfinite(field.measured)
    typical = OUTLIER * max(float(np.median(noise[used])), 1e-4)
    trust = np.where(used, 1.0 / (1.0 + (noise / typical) ** 2), 0.0)
    return replace(problem, field=replace(field, trust=trust))


@dataclass(frozen=True)
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


def tried(problem: LampProblem, candidates: Candidates, before: Tried | None) -> Tried:
    """One lamp more than `before`; the same surfels are trusted, so that numbers can be compared."""
    lamps = with_one_more(problem, candidates, None if before is None else before.lamps)
    for _ in range(2):
        problem = replace(problem, field=problem.field.fitted(problem.residual(lamps)))
        lamps = problem.refined(lamps, LAST)
    return Tried(problem, lamps, problem.field.deviance(problem.residual(lamps)))


def is_worth(fewer: Tried, more: Tried) -> bool:
    """Whether the lamp that `more` has beyond `fewer` is there."""
    measurements = 3 * int((more.problem.field.weight > 0.0).sum())
    return fewer.deviance - more.deviance > WORTH * NUMBERS * np.log(measurements)


def found_lamps(problem: LampProblem, candidates: Candidates, count: int | None, most: int) -> Sequence[Tried]:
    """Lamps of rising number, the last of them the answer, or one that is not worth it behind the answer."""
    found: list[Tried] = []
    while len(found) < (count or most):
        found.append(tried(found[-1].problem if found else problem, candidates, found[-1] if found else None))
        if count is None and len(found) > 1 and not is_worth(found[-2], found[-1]):
            break
    return found
