"""Minima beside each other, as edges of shadows make them: each lamp is looked for again from places around it."""

from __future__ import annotations

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


def settled_beside(problem: LampProblem, candidates: Candidates, lamps: Lamps) -> Lamps:
    """The least minimum that is reached by moving one lamp after the other to a better one beside it."""
    for own in range(len(lamps)):
        beside = looked_beside(problem, candidates, lamps, own)
        if beside is not lamps:
            return settled_beside(problem, candidates, beside)
    return lamps


def looked_beside(problem: LampProblem, candidates: Candidates, lamps: Lamps, own: int) -> Lamps:
    """Lamps of which one has moved to a better minimum beside, or the same if none is found."""
    best = cheapest_beside(problem, candidates, lamps, own)
    return best if best is not None and problem.cost(best) < problem.cost(lamps) else lamps


def cheapest_beside(problem: LampProblem, candidates: Candidates, lamps: Lamps, own: int) -> Lamps | None:
    """The least other minimum that is reached from around one of the lamps, if there is any."""
    others = lamps.at([other for other in range(len(lamps)) if other != own]) if len(lamps) > 1 else None
    around = candidates.around(problem, lamps.places[own])
    costs, _ = ranked(problem, around, others)
    found = []
    for index in np.argsort(costs)[:AROUND]:
        places = lamps.places.copy()
        places[own] = around.places[index]
        beside = problem.refined(problem.lamps(places, lamps.logs), FIRST)
        if _is_apart(candidates, beside, lamps, own):
            found.append(beside)
    return problem.refined(min(found, key=problem.cost), STEPS) if found else None


def likeliest(candidates: Candidates, best: Tried) -> Tried:
    """The likeliest of the minima that are reached by moving one lamp after the other, each by its own variances."""
    count = len(best.lamps)
    with progress_bar([], "comparing places of lamps", 1 + count, unit="step") as bar:
        best = Tried.settled(best.problem, best.lamps)
        bar.update()
        for passes in range(1, ROUNDS + 1):
            before, bar.total = best, 1 + passes * count
            for own in range(count):
                best = likelier_beside(candidates, best, own)
                bar.update()
            if best is before:
                break
    return best


def likelier_beside(candidates: Candidates, best: Tried, own: int) -> Tried:
    """Lamps of which one has moved to a likelier minimum beside, or the same if none is found."""
    problem = best.problem
    beside = cheapest_beside(problem, candidates, best.lamps, own)
    if beside is None or problem.cost(beside) > RIVAL * problem.cost(best.lamps):
        return best
    rival = Tried.settled(problem, beside)
    apart = _is_apart(candidates, rival.lamps, best.lamps, own)
    return rival if apart and rival.likelier_than(best) else best


def _is_apart(candidates: Candidates, lamps: Lamps, known: Lamps, own: int) -> bool:
    """Whether one of the lamps stands in another minimum: nearer than half of the way to the next is the known one."""
    return bool(np.linalg.norm(lamps.places[own] - known.places[own]) > 0.5 * candidates.between)
