"""Whether an answer has a light more than the target calls for, so that too large a number is told.

A light too many does not look wrong by itself: it stands in for what the model gets wrong, or splits a true one in two.
So a search with a known number leaves out its lights one at a time, the faintest first, lets the others move, and asks
whether the light was worth it, as a search with an unknown number does.
"""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search.judge import FAINT_DROP, drop, light_energies, worth_one_more
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import SHORT_ITERATIONS
from rgspipe.fitting.search.weighting import ROBUST

#: Steps of the others before it is clear that a light is there, and as many more where it is not.
TURN = SHORT_ITERATIONS // 2


@dataclass(frozen=True)
class OneLess:
    """An answer, and a rig with one of its lights less.

    Attributes:
        rich, simple: the two rigs; of all rigs with one light less the first that is as good, else the last.
        index: which light was left out.
        worth: whether that light is there, rather than an error of the model.
        gain: by what share it lowers the robust cost.
    """

    rich: State
    simple: State
    index: int
    worth: bool
    gain: float


def one_light_less(refiner: Refiner, answer: State) -> OneLess:
    """The answer beside its rigs with one light less.

    Args:
        refiner: on the problem that the answer was searched on.
        answer: of two lights or more.
    """
    energies, rich, problem = light_energies(answer), answer, refiner.problem
    for index in sorted(range(len(energies)), key=energies.__getitem__):
        simple = refiner.refined(refiner.start(_without(answer, index), ROBUST), ROBUST, TURN)
        # An answer of plain squares has a higher robust cost than it would have to have.
        worth = drop(problem, simple, rich) >= FAINT_DROP
        if worth:
            continue
        if rich is answer:
            rich = refiner.refined(answer, ROBUST, SHORT_ITERATIONS)
        simple = refiner.refined(simple, ROBUST, TURN)
        worth = worth_one_more(problem, simple, rich)
        if not worth:
            break
    return OneLess(rich, simple, index, worth, drop(problem, simple, rich))


def _without(answer: State, index: int) -> list[Emitter]:
    return [emitter for k, emitter in enumerate(answer.emitters) if k != index]
