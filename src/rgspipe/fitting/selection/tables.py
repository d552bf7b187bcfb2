"""Which measured luminaire of a catalogue each light is: the answer with each other table in its place.

A search has candidates of every table, but starts from one at a place and with an axis, the one that looks most like
the target before anything moves. The right one may look worse there, where another made up for a wrong place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from rgspipe.fitting.findings import KindOpen
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import light_energies
from rgspipe.fitting.search.grow import STARTS
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.schedule import refined_starts
from rgspipe.fitting.search.starts import EmitterRig
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.rivals import as_good
from rgspipe.fitting.spec import LightSpec
from rgspipe.scene import Light


def told_tables(
    refiner: Refiner, answer: State, spec: LightSpec, options: SearchOptions
) -> tuple[State, tuple[State, ...]]:
    """The answer with the table of each light that explains most, and the rigs of others that were refined.

    Args:
        answer: of lights that have one table of the catalogue each.
    """
    tables, others = spec.tables, []
    if len(tables) < 2:
        return answer, ()
    energies = light_energies(answer)
    for index in sorted(range(len(energies)), key=lambda k: -energies[k]):
        refined = with_tables(refiner, answer, index, tables, options)
        answer, *worse = sorted([answer, *refined], key=refiner.unexplained)
        others += worse
    return answer, tuple(others)


def with_tables(
    refiner: Refiner, answer: State, index: int, tables: Sequence[Light], options: SearchOptions
) -> list[State]:
    """Refined rigs with every other table in the place of the light `index`, which has an axis."""
    rigs = list(_replaced(refiner, answer, index, tables))
    return refined_starts(refiner, rigs, options.iterations, options.schedule, answer)


def tables_open(
    refiner: Refiner, answer: State, others: Sequence[State], options: SearchOptions
) -> tuple[KindOpen, ...]:
    """The tables of other rigs, light by light, that explain the target as well as those of the answer.

    Args:
        refiner: on the problem that all of them were polished on.
    """
    count, found = len(answer.emitters), {}
    for other in others:
        pairs = zip(answer.emitters, other.emitters, strict=False)
        kinds = [(k, b.light) for k, (a, b) in enumerate(pairs, start=1) if _another_table(a.light, b.light)]
        if kinds and as_good(refiner, answer, other, options.rivals):
            found |= {(k, light.label): None for k, light in kinds}
    return tuple(KindOpen(number, count, label) for number, label in found)


def _another_table(one: Light, other: Light) -> bool:
    return one.kind == other.kind and not one.same_sort(other)


def _replaced(refiner: Refiner, answer: State, index: int, tables: Sequence[Light]) -> Iterator[EmitterRig]:
    """Rigs with every other table in the place of a light, in those turns that look most like the target."""
    found, size = answer.emitters[index], refiner.region.size
    before, after = answer.emitters[:index], answer.emitters[index + 1 :]
    for table in tables:
        if not table.same_sort(found.light):
            turned = [_as(found, light) for light in table.grown(size, True)]
            starts = [refiner.start((*before, one, *after), PLAIN, answer) for one in turned]
            yield from (state.emitters for state in sorted(starts, key=refiner.unexplained)[:STARTS])


def _as(found: Emitter, light: Light) -> Emitter:
    return replace(found, light=light.at(found.position, found.axis))
