"""Whether an answer has a light more than the target calls for, so that too large a number is told.

A light too many does not look wrong by itself: it stands in for what the model gets wrong, or splits a true one in two.
So a search with a known number leaves out its lights one at a time, the faintest first, lets the others move, and asks
whether the light was worth it, as a search with an unknown number does.
"""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.findings import LightSpare
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import BarOptions
from rgspipe.fitting.search.compare import Wanted, drop, light_energies, wanted
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import ROBUST


@dataclass(frozen=True)
class OneLess:
    """An answer, and a rig with one of its lights less.

    Attributes:
        rich, simple: the two rigs; of all rigs with one light less the first that is as good, else the last.
        index: which light was left out.
        gain: by what share it lowers the robust cost.
        wanted: what it would have to.
    """

    rich: State
    simple: State
    index: int
    gain: float
    wanted: Wanted

    @property
    def worth(self) -> bool:
        """Whether that light is there, rather than an error of the model."""
        return self.gain >= self.wanted.share

    @property
    def findings(self) -> list[LightSpare]:
        """What there is to be said of the number."""
        if self.worth:
            return []
        count, share, setting = len(self.rich.emitters), self.wanted.share, self.wanted.setting
        return [LightSpare(self.index + 1, count, self.gain, share, decided_by=(setting,))]


def one_light_less(refiner: Refiner, answer: State, bar: BarOptions, steps: int = 3) -> OneLess:
    """The answer beside its rigs with one light less.

    Args:
        refiner: on the problem that the answer was searched on.
        answer: of two lights or more.
        bar: how much a light has to explain.
        steps: of the others before it is clear that a light is there, and as many more where it is not.
    """
    energies, rich, problem = light_energies(answer), answer, refiner.problem
    for index in sorted(range(len(energies)), key=energies.__getitem__):
        simple = refiner.refined(refiner.start(_without(answer, index), ROBUST, answer), ROBUST, steps)
        found = OneLess(rich, simple, index, drop(problem, simple, rich), wanted(rich, bar))
        # An answer of plain squares has a higher robust cost than it would have to have.
        if found.gain >= bar.least_faint:
            continue
        if rich is answer:
            rich = refiner.refined(answer, ROBUST, 2 * steps)
        simple = refiner.refined(simple, ROBUST, steps)
        found = OneLess(rich, simple, index, drop(problem, simple, rich), wanted(rich, bar))
        if not found.worth:
            break
    return found


def _without(answer: State, index: int) -> list[Emitter]:
    return [emitter for k, emitter in enumerate(answer.emitters) if k != index]
