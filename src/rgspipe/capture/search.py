"""Where lamps may be: candidates all over the scene, ranked on surfels alone, and how many of them it takes.

The best candidates are refined. One lamp more is there if it makes what was measured so much more likely, with the
variances of the albedo estimated anew for either number: a lamp that is left out looks like paint, and the more of it
there is to explain, the less is paint expected to change. How much is enough is what a light of a fit has to lower its
cost by (`fitting.options.BarOptions`): of n measurements a share g of their squares is worth −n log(1 − g) of −2 log p.

Edges of shadows make many minima beside each other, so that each lamp is looked for again from places around it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rgspipe.capture.candidates import CandidateLamps, ranked
from rgspipe.capture.field import Graph
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.likelihood import ROUNDS, STEPS, Tried, settled_once, weighed
from rgspipe.capture.minima import (
    ALL_AROUND,
    AROUND,
    FIRST,
    LIKELY,
    LessLikely,
    RivalLamps,
    likelier_among,
    likeliest,
    settled_beside,
    with_chances,
)
from rgspipe.capture.side_by_side import side_by_side
from rgspipe.capture.variances import with_likely_variances
from rgspipe.fitting.options import BarOptions
from rgspipe.fitting.search.apart import CandidatePlaces
from rgspipe.progress import progress_bar

#: Candidates that are refined, and least distance of two of them in parts of the scene's size.
TRIES, APART = 5, 0.14

#: How much one more lamp has to explain.
BAR = BarOptions()

#: Is told of each refinement.
Told = Callable[[int], object]


def with_one_more(problem: LampProblem, candidates: CandidateLamps, known: Lamps | None, told: Told) -> Lamps:
    """The best lamps found that are one more than `known`; TRIES + 1 refinements at most."""
    costs, logs = ranked(problem, candidates, known)
    ranking, standing = [(int(index),) for index in np.argsort(costs)], CandidatePlaces(candidates.places, None, 0.0)

    def refined(index: int) -> Lamps:
        place, log = candidates.places[index][None], np.full((1, 3), logs[index])
        places = place if known is None else np.concatenate([known.places, place])
        gains = log if known is None else np.concatenate([known.logs, log])
        lamps = problem.refined(problem.lamps(places, gains), FIRST)
        told(1)
        return lamps

    apart = standing.first_apart(ranking, TRIES, APART * problem.size)
    found = side_by_side(refined, [index for (index,) in apart])
    best = problem.refined(min(found, key=problem.cost), STEPS)
    told(1)
    return best


def settled(problem: LampProblem, candidates: CandidateLamps, lamps: Lamps, told: Told) -> Tried:
    """With variances, outliers and unseen albedo that belong to the lamps, and lamps that belong to these."""
    for left in reversed(range(ROUNDS)):
        problem, lamps = settled_once(problem, lamps)
        told(1)
        if left == 1:
            if len(lamps) > 1:
                lamps = looked_for_again(problem, candidates, lamps, told)
            lamps = settled_beside(problem, candidates, lamps)
            told(AROUND * len(lamps))
    return Tried.of(problem, lamps)


def looked_for_again(problem: LampProblem, candidates: CandidateLamps, lamps: Lamps, told: Told) -> Lamps:
    """Each lamp in the place that is best beside the others: it was found by variances of a room without it."""
    for own in range(len(lamps)):
        others = [other for other in range(len(lamps)) if other != own]
        again = with_one_more(problem, candidates, lamps.at(others), told).at(np.argsort([*others, own]).tolist())
        lamps = min(lamps, again, key=problem.cost)
    return lamps


@dataclass(frozen=True, eq=False)
class OneMoreLamp:
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
    def between(cls, fewer: Tried, more: Tried) -> OneMoreLamp:
        """By the variances that are most likely for either."""
        measurements = more.problem.field.measurements
        gain = 1.0 - float(np.exp(min(0.0, more.deviance - fewer.deviance) / max(measurements, 1)))
        sent = more.lamps.sent(more.problem.receivers.areas)
        faint = sent.min() < BAR.faint * sent.sum()
        return cls(fewer, more, gain, BAR.least_faint if faint else BAR.least)

    @property
    def worth(self) -> bool:
        """Whether that lamp is there."""
        return self.gain >= self.wanted


def best_with_one_more(problem: LampProblem, candidates: CandidateLamps, known: Lamps | None) -> Tried:
    """The best lamps found that are one more than `known`, settled, while a progress line stands."""
    number = 1 if known is None else len(known) + 1
    looks = 1 if known is None else 1 + number
    steps = looks * (TRIES + 1) + ROUNDS + AROUND * number
    with progress_bar([], f"looking for lamp {number}", steps, unit="step") as bar:
        lamps = with_one_more(problem, candidates, known, bar.update)
        return settled(problem, candidates, lamps, bar.update)


def one_more(candidates: CandidateLamps, fewer: Tried) -> OneMoreLamp:
    """The best lamps found that are one more than `fewer`."""
    more = best_with_one_more(fewer.problem, candidates, fewer.lamps)
    return OneMoreLamp.between(Tried.refined(more.problem, fewer.lamps), more)


@dataclass(frozen=True, eq=False)
class FoundLamps:
    """Lamps that were found.

    Attributes:
        best: the lamps.
        rivals: other minima that they may belong to.
        compared: each number with the next, as far as it was asked; the last of them may not be worth it.
        over_even: share of the squares that the lamps explain of those that light which is the same everywhere leaves.
    """

    best: Tried
    rivals: tuple[RivalLamps, ...]
    compared: tuple[OneMoreLamp, ...]
    over_even: float


def found_lamps(problem: LampProblem, count: int | None, most: int) -> FoundLamps:
    """So many lamps, or as many as what was measured calls for, one to `most`."""
    # What others know of the paint has the variances that belong to bends.
    plain = problem if problem.field.known is not None else _without_bends(problem)
    plain = weighed(plain, None)
    candidates = CandidateLamps.of(plain)
    best, others = _likeliest(candidates, best_with_one_more(plain, candidates, None))
    compared: list[OneMoreLamp] = []
    while count is None or len(best.lamps) < count:
        found = one_more(candidates, best)
        compared.append(found)
        if count is None and (not found.worth or len(best.lamps) == most):
            break
        best, others = _likeliest(candidates, found.more)
    told = over_even(best)
    if plain is not problem:
        best, others = Tried.settled(_on_graph(best.problem, problem.field.graph), best.lamps), []
    minima = with_chances(likeliest(candidates, best, others, ALL_AROUND), others)
    return FoundLamps(minima.best, minima.rivals, tuple(compared), told)


def _without_bends(problem: LampProblem) -> LampProblem:
    """With paint that is rough: a lamp that is left out looks like paint that changes slowly."""
    return _on_graph(problem, replace(problem.field.graph, bent=None))


def _on_graph(problem: LampProblem, graph: Graph) -> LampProblem:
    return replace(problem, field=replace(problem.field, graph=graph))


def _likeliest(candidates: CandidateLamps, found: Tried) -> tuple[Tried, list[LessLikely]]:
    """The likeliest lamps beside those found, settled, and the others that were."""
    others: list[LessLikely] = []
    return likeliest(candidates, Tried.settled(found.problem, found.lamps), others), others


def settled_on_all(problem: LampProblem, found: FoundLamps) -> FoundLamps:
    """Lamps that were found on a part of the surfels, where they belong by all of them; likewise likely rivals."""
    problem = weighed(problem, None)
    likely = [rival.tried.lamps for rival in found.rivals if rival.chance > LIKELY]
    rest = tuple(rival for rival in found.rivals if rival.chance <= LIKELY)
    others: list[LessLikely] = []
    with progress_bar([], "settling lamps on all surfels", 1 + len(likely), unit="place") as bar:
        best = Tried.settled(problem, problem.lamps(found.best.lamps.places, found.best.lamps.logs))
        bar.update()
        whole = best.problem
        reached = side_by_side(lambda one: whole.refined(whole.lamps(one.places, one.logs), FIRST), likely)
        best = likelier_among(best, sorted(reached, key=whole.cost), others)
        bar.update(len(likely))
    minima = with_chances(best, others)
    return replace(found, best=minima.best, rivals=(*minima.rivals, *rest))


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
