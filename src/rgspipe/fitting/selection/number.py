"""Whether the number of lights that was given is right: the answer beside rigs of one light more and one less."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rgspipe.fitting.findings import Finding, LightMissing, LightSpare
from rgspipe.fitting.search.compare import Bar, energy_shares
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import Schedule
from rgspipe.fitting.search.starts import Candidates
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.one_less import one_light_less
from rgspipe.fitting.selection.one_more import OneMoreOptions, one_more_light
from rgspipe.fitting.spec import MOST_LIGHTS


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
    refiner: Refiner,
    candidates: Sequence[Candidates],
    best: State,
    wanted: int,
    bar: Bar,
    options: OneMoreOptions,
    schedule: Schedule,
) -> Doubted:
    """What is wrong with the number `wanted`, of which `best` is the answer."""
    count = len(best.emitters)
    findings: list[Finding] = []
    compared: dict[int, State] = {}
    more = None
    if count == wanted < MOST_LIGHTS:
        more = one_more_light(refiner, candidates, best, bar, options, schedule)
    if more is not None:
        compared |= {count: more.simple, count + 1: more.rich}
        findings += [LightMissing(count, more.gain)] if more.worth else []
    if count > 1:
        less = one_light_less(refiner, best, bar, schedule.steps // 2)
        compared |= {count - 1: less.simple, count: less.rich}
        findings += less.findings
    return Doubted(tuple(findings), compared)


def faded_light(refiner: Refiner, polished: State, bar: Bar, schedule: Schedule) -> list[LightSpare]:
    """What `doubted_number` says of the number being too large, where the polish has left a light next to nothing."""
    if min(energy_shares(polished)) >= schedule.alike.least_energy:
        return []
    return one_light_less(refiner, refiner.start(polished.emitters, PLAIN), bar, schedule.steps // 2).findings
