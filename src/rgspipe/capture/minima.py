"""Minima beside each other, as edges of shadows make them: each lamp is looked for again from places around it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rgspipe.capture.candidates import CandidateLamps, ranked
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.likelihood import ROUNDS, STEPS, Comparison, Tried, chances
from rgspipe.capture.side_by_side import side_by_side
from rgspipe.fitting.certainty.regions import CONFIDENCE
from rgspipe.progress import progress_bar

#: Places around a lamp from which it is refined, of 26: the best of these led out of most false minima that were met.
AROUND = 3

#: Likewise of the lamps that were settled upon: of two rooms where these were wrong, the better place was reached from
#: the fourth and the twelfth.
ALL_AROUND = 12

#: Steps from each.
FIRST = 8

#: By other variances a minimum may be the likelier one that is so in this part of the draws of the scene's parts.
POSSIBLE = 0.001

#: So many settle side by side, on however many cores, as what each comes to may save others the way.
AT_ONCE = 2

#: One that is likelier than this is told, and a region of 95 % holds it.
LIKELY = 1.0 - CONFIDENCE


@dataclass(frozen=True, eq=False)
class RivalLamps:
    """Lamps in another minimum than the likeliest.

    Attributes:
        tried: with what belongs to them.
        chance: of their being the right ones.
    """

    tried: Tried
    chance: float


@dataclass(frozen=True, eq=False)
class LessLikely:
    """Settled lamps that were compared with likelier ones.

    Attributes:
        tried: with what belongs to them, put by.
        likelier: what they were compared with.
        gain: how much likelier these are.
    """

    tried: Tried
    likelier: Tried
    gain: Comparison

    def than(self, best: Tried) -> Comparison:
        """How much likelier `best` is."""
        return self.gain if best is self.likelier else best.over(self.tried.put_by())


@dataclass(frozen=True, eq=False)
class Minima:
    """The likeliest minimum that was reached, and the others that were."""

    best: Tried
    rivals: tuple[RivalLamps, ...]


def settled_beside(problem: LampProblem, candidates: CandidateLamps, lamps: Lamps) -> Lamps:
    """The least minimum that is reached by moving one lamp after the other to a better one beside it."""
    own = stays = 0
    while stays < len(lamps):
        beside = looked_beside(problem, candidates, lamps, own)
        stays = stays + 1 if beside is lamps else 0
        lamps, own = beside, (own + 1) % len(lamps)
    return lamps


def looked_beside(problem: LampProblem, candidates: CandidateLamps, lamps: Lamps, own: int) -> Lamps:
    """Lamps of which one has moved to a better minimum beside, or the same if none is found."""
    found = minima_beside(problem, candidates, lamps, own)
    best = problem.refined(found[0], STEPS) if found else lamps
    return best if problem.cost(best) < problem.cost(lamps) and _is_new(problem, best, [lamps]) else lamps


def minima_beside(
    problem: LampProblem, candidates: CandidateLamps, lamps: Lamps, own: int, around: int = AROUND
) -> list[Lamps]:
    """Other minima that are nearly reached from so many places around one of the lamps, the least first."""
    others = lamps.at([other for other in range(len(lamps)) if other != own]) if len(lamps) > 1 else None
    beside = candidates.around(problem, lamps.places[own])
    costs, _ = ranked(problem, beside, others)

    def refined(index: int) -> Lamps:
        places = lamps.places.copy()
        places[own] = beside.places[index]
        return problem.refined(problem.lamps(places, lamps.logs), FIRST)

    found: list[Lamps] = []
    for one in sorted(side_by_side(refined, np.argsort(costs)[:around]), key=problem.cost):
        if _is_new(problem, one, (lamps, *found)):
            found.append(one)
    return found


def likeliest(candidates: CandidateLamps, best: Tried, others: list[LessLikely], around: int = AROUND) -> Tried:
    """The likeliest of the minima that are reached by moving one lamp after the other, each by its own variances.

    From so many places around each; what is settled on the way joins `others`, as in `likelier_among`.
    """
    count, stays = len(best.lamps), 0
    with progress_bar([], "comparing places of lamps", count, unit="step") as bar:
        for look in range(ROUNDS * count):
            before, own = best, look % count
            best = likelier_among(best, minima_beside(best.problem, candidates, best.lamps, own, around), others)
            stays = stays + 1 if best is before else 0
            bar.total = min(look + 1 + count - stays, ROUNDS * count)
            bar.update()
            if stays == count:
                break
    return best


def with_chances(best: Tried, others: Sequence[LessLikely]) -> Minima:
    """The likeliest minimum and how likely each of the others is; those that came to the same place count once."""
    rivals: list[LessLikely] = []
    for other in others:
        if _is_new(best.problem, other.tried.lamps, _lamps(best, rivals)):
            rivals.append(other)
    chance = chances(side_by_side(lambda rival: rival.than(best), rivals))[1:]
    return Minima(best, tuple(RivalLamps(rival.tried, float(own)) for rival, own in zip(rivals, chance, strict=True)))


def likelier_among(best: Tried, minima: Sequence[Lamps], others: list[LessLikely]) -> Tried:
    """The likeliest of the best lamps and other `minima`, by the best's variances, that may be likelier by their own.

    What is settled on the way and is not the answer joins `others`; what comes to where these are is not followed.
    """
    problem, waiting = best.problem, list(minima)
    while waiting:
        known, batch = _lamps(best, others), list[Lamps]()
        while waiting and len(batch) < AT_ONCE:
            beside = waiting.pop(0)
            if _is_new(problem, beside, known) and best.costs_less(beside).doubt >= POSSIBLE:
                batch.append(beside)
        is_new = partial(_is_new, problem, known=known)
        for rival in side_by_side(lambda lamps, new=is_new: Tried.settled_if(problem, lamps, new), batch):
            if rival is None or not _is_new(problem, rival.lamps, _lamps(best, others)):
                continue
            than = best.over(rival)
            less, best, than = (rival, best, than) if than.gain >= 0.0 else (best, rival, than.turned)
            others.append(LessLikely(less.put_by(), best, than))
    return best


def _lamps(best: Tried, others: Sequence[LessLikely]) -> list[Lamps]:
    return [best.lamps, *(one.tried.lamps for one in others)]


def _is_new(problem: LampProblem, lamps: Lamps, known: Iterable[Lamps]) -> bool:
    """Whether one of the lamps stands where none of the known does, as far as surfels tell places apart."""
    return all(np.linalg.norm(lamps.places - one.places, axis=1).max() > problem.resolved for one in known)
