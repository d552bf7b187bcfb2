"""Whether one light more than were asked for would explain clearly more, so that too small a number is told.

What a wrong number leaves unexplained may be little: one light explains more than 95 % of the energy of two that stand
close together, or of which one is weak. So a search with a known number asks the candidates in closed form whether one
of them beside the answer promises enough, and only then refines a few rigs of one light more, to be compared as those
of unknown numbers are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import Wanted, best_state, drop, energy_shares, wanted
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import refined_starts
from rgspipe.fitting.search.starts import Candidates, EmitterRig
from rgspipe.fitting.search.weighting import ROBUST


@dataclass(frozen=True)
class OneMore:
    """An answer, and the best rig found that has one light more, both refined under the robust loss.

    Attributes:
        simple, rich: the two rigs.
        gain: by what share the light lowers the robust cost.
        wanted: what it would have to.
    """

    simple: State
    rich: State
    gain: float
    wanted: Wanted

    @property
    def worth(self) -> bool:
        """Whether that light is there, rather than an error of the model."""
        return self.gain >= self.wanted.share


def one_more_light(
    refiner: Refiner,
    candidates: Sequence[Candidates],
    answer: State,
    options: SearchOptions,
) -> OneMore | None:
    """The answer beside the best rig with one light more; None where no candidate promises enough.

    Args:
        refiner: on the problem that the answer was searched on.
        candidates: of each kind of light.
    """
    bar, steps, tries = options.bar, options.schedule.steps, max(1, options.starts // 2)
    if bar.unnoticed(refiner.unexplained(answer)):
        return None
    rigs: list[EmitterRig] = []
    for kind in candidates:
        promise, extended = kind.promised(answer, refiner.problem, tries, refiner.region.size)
        sure = promise >= bar.least_faint
        if promise >= bar.least and (sure or _last_share(refiner, extended[0], answer) >= bar.begins_faint):
            rigs += extended
    if not rigs:
        return None
    rich = best_state(refiner.problem, refined_starts(refiner, rigs, steps, options.schedule, answer))
    simple, rich = (refiner.refined(state, ROBUST, steps) for state in (answer, rich))
    return OneMore(simple, rich, drop(refiner.problem, simple, rich), wanted(rich, bar))


def _last_share(refiner: Refiner, rig: EmitterRig, answer: State) -> float:
    """What the last light of a rig sends of all its energy, at first sight."""
    return energy_shares(refiner.start(rig, ROBUST, answer))[-1]
