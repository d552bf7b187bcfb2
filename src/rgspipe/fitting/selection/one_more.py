"""Whether one light more than were asked for would explain clearly more, so that too small a number is told.

What a wrong number leaves unexplained may be little: one light explains more than 95 % of the energy of two that stand
close together, or of which one is weak. So a search with a known number asks the candidates in closed form whether one
of them beside the answer promises enough, and only then refines a few rigs of one light more, to be judged as those of
unknown numbers are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rgspipe.fitting.search.judge import FAINT_DROP, best_state, light_energies
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import SHORT_ITERATIONS, refine_starts
from rgspipe.fitting.search.starts import Candidates, Rig
from rgspipe.fitting.search.weighting import ROBUST

#: An answer that leaves less than this share of the blocks' energy unexplained is not doubted: that is rounding, or
#: noise.
NOTICEABLE = 1e-4

#: The best candidate beside the answer must promise to lower the squared relative error by this share, …
PROMISED = 0.23

#: … and a light that begins with less than this share of the image's energy, by as much as faint ones must.
BEGINS_FAINT = 0.03

#: So many rigs of each kind of candidate are refined.
TRIES = 2


@dataclass(frozen=True)
class OneMore:
    """An answer, and the best rig found that has one light more, both refined under the robust loss.

    Attributes:
        simple, rich: the two rigs.
    """

    simple: State
    rich: State


def one_more_light(refiner: Refiner, candidates: Sequence[Candidates], answer: State) -> OneMore | None:
    """The answer beside the best rig with one light more; None where no candidate promises enough.

    Args:
        refiner: on the problem that the answer was searched on.
        candidates: of each kind of light.
    """
    if refiner.unexplained(answer) < NOTICEABLE:
        return None
    rigs: list[Rig] = []
    for kind in candidates:
        promise, extended = kind.promised(answer, refiner.problem, TRIES, refiner.region.size)
        if promise >= PROMISED and (promise >= FAINT_DROP or _noticed(refiner, extended[0])):
            rigs += extended
    if not rigs:
        return None
    rich = best_state(refiner.problem, refine_starts(refiner, rigs, SHORT_ITERATIONS))
    simple, rich = (refiner.refined(state, ROBUST, SHORT_ITERATIONS) for state in (answer, rich))
    return OneMore(simple, rich)


def _noticed(refiner: Refiner, rig: Rig) -> bool:
    """Whether the last light of a rig sends enough of the energy to be no error of the model at first sight."""
    energies = light_energies(refiner.start(rig, ROBUST))
    return energies[-1] >= BEGINS_FAINT * sum(energies)
