"""Minima beside each other, as edges of shadows make them: each lamp is looked for again from places around it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rgspipe.capture.candidates import Candidates, ranked
from rgspipe.capture.lamps import LampProblem, Lamps
from rgspipe.capture.likelihood import ROUNDS, STEPS, Tried
from rgspipe.fitting.options import BarOptions
from rgspipe.progress import progress_bar

#: Places around a lamp from which it is refined, of 26: the best of these led out of the false minima that were met.
AROUND = 3

#: Steps from each.
FIRST = 8

#: By other variances a minimum may be the likelier one that leaves up to what one lamp more would have to explain.
RIVAL = 1.0 / (1.0 - BarOptions().least)


@dataclass(frozen=True, eq=False)
class Rival:
    """Lamps in another minimum than the likeliest.

    Attributes:
        tried: with what belongs to them.
        odds: of their being the right ones, against the likeliest.
    """

    tried: Tried
    odds: float


@dataclass(frozen=True, eq=False)
class Minima:
    """The likeliest minimum that was reached, and the others that were."""

    best: Tried
    rivals: tuple[Rival, ...]


def settled_beside(problem: LampProblem, candidates: Candidates, lamps: Lamps) -> Lamps:
    """The least minimum that is reached by moving one lamp after the other to a better one beside it."""
    for own in range(len(lamps)):
        beside = looked_beside(problem, candidates, lamps, own)
        if beside is not lamps:
            return settled_beside(problem, candidates, beside)
    return lamps


def looked_beside(problem: LampProblem, candidates: Candidates, lamps: Lamps, own: int) -> Lamps:
    """Lamps of which one has moved to a better minimum beside, or the same if none is found."""
    found = minima_beside(problem, candidates, lamps, own)
    best = problem.refined(found[0], STEPS) if found else lamps
    return best if problem.cost(best) < problem.cost(lamps) else lamps


def minima_beside(problem: LampProblem, candidates: Candidates, lamps: Lamps, own: int) -> list[Lamps]:
    """Other minima that are nearly reached from around one of the lamps, the least first."""
    others = lamps.at([other for other in range(len(lamps)) if other != own]) if len(lamps) > 1 else None
    around = candidates.around(problem, lamps.places[own])
    costs, _ = ranked(problem, around, others)
    reached = []
    for index in np.argsort(costs)[:AROUND]:
        places = lamps.places.copy()
        places[own] = around.places[index]
        reached.append(problem.refined(problem.lamps(places, lamps.logs), FIRST))
    found: list[Lamps] = []
    for beside in sorted(reached, key=problem.cost):
        if all(_are_apart(candidates, beside, known) for known in (lamps, *found)):
            found.append(beside)
    return found


def likeliest(candidates: Candidates, best: Tried) -> Minima:
    """The likeliest of the minima that are reached by moving one lamp after the other, each by its own variances."""
    count = len(best.lamps)
    with progress_bar([], "comparing places of lamps", 1 + count, unit="step") as bar:
        best, others = Tried.settled(best.problem, best.lamps), list[Tried]()
        bar.update()
        for passes in range(1, ROUNDS + 1):
            before, bar.total = best, 1 + passes * count
            for own in range(count):
                best = likelier_beside(candidates, best, own, others)
                bar.update()
            if best is before:
                break
    rivals = [other for other in others if _are_apart(candidates, other.lamps, best.lamps)]
    return Minima(best, tuple(Rival(rival, best.over(rival).odds) for rival in rivals))


def likelier_beside(candidates: Candidates, best: Tried, own: int, others: list[Tried]) -> Tried:
    """Lamps of which one has moved to a likelier minimum beside, or the same if none is found.

    What is settled on the way and is not the answer joins `others`, from which none is settled again.
    """
    problem, least = best.problem, best.problem.cost(best.lamps)
    for beside in minima_beside(problem, candidates, best.lamps, own):
        known = (best, *others)
        if problem.cost(beside) > RIVAL * least or not _is_new(candidates, beside, known):
            continue
        rival = Tried.settled(problem, beside)
        if not _is_new(candidates, rival.lamps, known):
            continue
        less, best = (best, rival) if rival.over(best).gain > 0.0 else (rival, best)
        others.append(less)
    return best


def _is_new(candidates: Candidates, lamps: Lamps, known: Iterable[Tried]) -> bool:
    return all(_are_apart(candidates, lamps, tried.lamps) for tried in known)


def _are_apart(candidates: Candidates, lamps: Lamps, known: Lamps) -> bool:
    """Whether one of the lamps stands in another minimum: nearer than half of the way to the next is the known one."""
    return bool(np.linalg.norm(lamps.places - known.places, axis=1).max() > 0.5 * candidates.between)
