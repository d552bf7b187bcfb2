"""Where lamps may be: candidates all over the scene, ranked on surfels alone, and how many of them it takes.

A candidate beside the lamps that are known is ranked with the intensity that suits it, in one grey channel, by a few
steps of Gauss and Newton that all candidates take at once. The best are refined. One lamp more is there if it makes
what was measured so much more likely, with the variances of the albedo estimated anew for either number: a lamp that is
left out looks like paint, and the more of it there is to explain, the less is paint expected to change. How much is
enough is what a light of a fit has to lower its cost by (`fitting.options.BarOptions`): of n measurements a share g of
their squares is worth −n log(1 − g) of −2 log p.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rgspipe.capture.bounds import with_bounds
from rgspipe.capture.doubts import model_variance
from rgspipe.capture.lamps import DARK, LampProblem, Lamps
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.variances import with_likely_variances
from rgspipe.fitting.options import BarOptions
from rgspipe.fitting.search.apart import CandidatePlaces
from rgspipe.progress import progress_bar
from rgspipe.training.albedo import ALBEDO_RANGE

#: Candidates that are refined, and least distance of two of them in parts of the scene's size.
TRIES, APART = 5, 0.14

#: Steps of candidates' intensities, and of lamps: at first and at last.
RANKING, FIRST, LAST = 5, 8, 25

#: Largest step of the logarithm of a candidate's intensity.
LONGEST_GAIN = 1.5

#: Candidates that are ranked at once.
BATCH = 128

#: How much one more lamp has to explain.
BAR = BarOptions()

#: Rounds in which outliers, variances and the albedo of the unseen follow from the lamps and these from them.
ROUNDS = 3

#: Is told of each refinement.
Told = Callable[[int], object]


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
    grey = _grey(problem)
    target = (grey * problem.target).sum(axis=1)
    light = problem.received.known + (0.0 if known is None else known.arriving)
    light = np.maximum(np.exp((grey * np.log(np.maximum(light, 1e-300))).sum(axis=1)), DARK * np.median(light))
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


def _grey(problem: LampProblem) -> Numbers:
    """(N, 3) what each channel counts in the mean of those that were measured."""
    told = problem.field.told
    if told is None:
        return np.full((len(problem.radiance), 3), 1.0 / 3.0)
    known = np.where(told.any(axis=1, keepdims=True), told, True)
    return known / known.sum(axis=1, keepdims=True)


def with_one_more(problem: LampProblem, candidates: Candidates, known: Lamps | None, told: Told) -> Lamps:
    """The best lamps found that are one more than `known`; TRIES + 1 refinements at most."""
    costs, logs = ranked(problem, candidates, known)
    ranking, standing = [(int(index),) for index in np.argsort(costs)], CandidatePlaces(candidates.places, None, 0.0)
    found = []
    for (index,) in standing.first_apart(ranking, TRIES, APART * problem.size):
        place, log = candidates.places[index][None], np.full((1, 3), logs[index])
        places = place if known is None else np.concatenate([known.places, place])
        gains = log if known is None else np.concatenate([known.logs, log])
        lamps = problem.refined(problem.lamps(places, gains), FIRST)
        found.append((problem.cost(lamps), lamps))
        told(1)
    best = problem.refined(min(found, key=lambda pair: pair[0])[1], LAST)
    told(1)
    return best


def settled(problem: LampProblem, candidates: Candidates, lamps: Lamps, told: Told) -> Tried:
    """With variances, outliers and unseen albedo that belong to the lamps, and lamps that belong to these."""
    for left in reversed(range(ROUNDS)):
        problem = weighed(problem, lamps)
        lamps = problem.refined(problem.lamps(lamps.places, lamps.logs), LAST)
        told(1)
        if left == 1 and len(lamps) > 1:
            lamps = looked_for_again(problem, candidates, lamps, told)
    return Tried.of(problem, lamps)


def looked_for_again(problem: LampProblem, candidates: Candidates, lamps: Lamps, told: Told) -> Lamps:
    """Each lamp in the place that is best beside the others: it was found by variances of a room without it."""
    for own in range(len(lamps)):
        others = [other for other in range(len(lamps)) if other != own]
        again = with_one_more(problem, candidates, lamps.at(others), told).at(np.argsort([*others, own]).tolist())
        lamps = min(lamps, again, key=problem.cost)
    return lamps


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


@dataclass(frozen=True, eq=False)
class OneMore:
    """Lamps, and the best found that are one more, both by the surfels that the latter trust.

    Attributes:
        gain: share of the squares that the lamp explains.
        wanted: the share that it has to.
    """

    fewer: Tried
    more: Tried
    gain: float
    wanted: float

    @classmethod
    def between(cls, fewer: Tried, more: Tried) -> OneMore:
        """By the variances that are most likely for either."""
        measurements = more.problem.field.measurements
        gain = 1.0 - float(np.exp(min(0.0, more.deviance - fewer.deviance) / max(measurements, 1)))
        sent = more.lamps.sent(more.problem.frozen.areas.double().cpu().numpy())
        faint = sent.min() < BAR.faint * sent.sum()
        return cls(fewer, more, gain, BAR.least_faint if faint else BAR.least)

    @property
    def worth(self) -> bool:
        """Whether that lamp is there."""
        return self.gain >= self.wanted


def best_with_one_more(problem: LampProblem, candidates: Candidates, known: Lamps | None) -> Tried:
    """The best lamps found that are one more than `known`, settled, while a progress line stands."""
    number = 1 if known is None else len(known) + 1
    looks = 1 if known is None else 1 + number
    with progress_bar([], f"looking for lamp {number}", looks * (TRIES + 1) + ROUNDS, unit="step") as bar:
        lamps = with_one_more(problem, candidates, known, bar.update)
        return settled(problem, candidates, lamps, bar.update)


def one_more(candidates: Candidates, fewer: Tried) -> OneMore:
    """The best lamps found that are one more than `fewer`."""
    more = best_with_one_more(fewer.problem, candidates, fewer.lamps)
    again = more.problem.lamps(fewer.lamps.places, fewer.lamps.logs)
    less = Tried.of(more.problem, more.problem.refined(again, LAST))
    return OneMore.between(less, more)


@dataclass(frozen=True, eq=False)
class Answer:
    """Lamps that were found.

    Attributes:
        best: the lamps.
        compared: each number with the next, as far as it was asked; the last of them may not be worth it.
        over_even: share of the squares that the lamps explain of those that light which is the same everywhere leaves.
    """

    best: Tried
    compared: tuple[OneMore, ...]
    over_even: float


def found_lamps(problem: LampProblem, count: int | None, most: int) -> Answer:
    """So many lamps, or as many as what was measured calls for, one to `most`."""
    problem = weighed(problem, None)
    candidates = Candidates.of(problem)
    best = best_with_one_more(problem, candidates, None)
    compared: list[OneMore] = []
    while count is None or len(best.lamps) < count:
        found = one_more(candidates, best)
        compared.append(found)
        if count is None and (not found.worth or len(best.lamps) == most):
            break
        best = found.more
    return Answer(best, tuple(compared), over_even(best))


def over_even(best: Tried) -> float:
    """The share of what light that is the same everywhere leaves of log L that the lamps explain.

    The surfels that the lamps trust, and variances that are most likely for either: paint may explain what the light
    does not.
    """
    problem = best.problem
    ones = problem.field.whitened_colours(np.ones_like(problem.target))
    residual = problem.target - (ones * problem.target).sum(axis=0) / np.maximum(ones.sum(axis=0), 1e-300)
    even = with_likely_variances(problem.field, residual).deviance(residual)
    measurements = problem.field.measurements
    return 1.0 - float(np.exp(min(0.0, best.deviance - even) / max(measurements, 1)))
