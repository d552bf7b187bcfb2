"""Whether the number of lights that was given is right: the answer beside rigs of one light more and one less."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rgspipe.fitting.findings import Finding, LightMissing, LightSpare
from rgspipe.fitting.options import MOST_LIGHTS, SearchOptions
from rgspipe.fitting.search.compare import energy_shares
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import Candidates
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.one_less import one_light_less
from rgspipe.fitting.selection.one_more import one_more_light


@dataclass(frozen=True)
class Doubted:
    """What doubting a number brought.

    Attributes:
        findings: what is wrong with it.
        compared: by number of lights the rigs that were compared.
    """

    findings: tuple[Finding, ...] = ()
    compared: dict[int, State] = field(default_factory=dict)


def doubted_number(
    refiner: Refiner, candidates: Sequence[Candidates], best: State, wanted: int, options: SearchOptions
) -> Doubted:
    """What is wrong with the number `wanted`, of which `best` is the answer."""
    count = len(best.emitters)
    findings: list[Finding] = []
    compared: dict[int, State] = {}
    more = one_more_light(refiner, candidates, best, options) if count == wanted < MOST_LIGHTS else None
    if more is not None:
        compared |= {count: more.simple, count + 1: more.rich}
        findings += [LightMissing(count, more.gain, decided_by=(more.wanted.setting,))] if more.worth else []
    if count > 1:
        less = one_light_less(refiner, best, options.bar, options.schedule.steps // 2)
        compared |= {count - 1: less.simple, count: less.rich}
        findings += less.findings
    return Doubted(tuple(findings), compared)


def faded_light(refiner: Refiner, polished: State, options: SearchOptions) -> list[LightSpare]:
    """What `doubted_number` says of the number being too large, where the polish has left a light next to nothing."""
    if min(energy_shares(polished)) >= options.bar.least_energy:
        return []
    answer = refiner.start(polished.emitters, PLAIN)
    return one_light_less(refiner, answer, options.bar, options.schedule.steps // 2).findings
