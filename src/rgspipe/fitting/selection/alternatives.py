"""What was weighed against an answer: lights of other numbers and clearly elsewhere, and how much worse they are."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.findings import Finding, LightMissing, LightSpare
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import distinct, rig_distance, robust_costs
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.selection.rivals import as_good

#: So many are told, the least bad ones: enough for what a person wants to look at.
TOLD = 5


def weighed(
    refiner: Refiner, answer: State, others: Sequence[State], findings: Sequence[Finding], options: SearchOptions
) -> list[Alternative]:
    """Those of the `others` that are of another number of lights or clearly elsewhere, the least bad one first.

    Args:
        refiner: on the problem that all of them were refined on.
        findings: what was found out about the number of lights.
    """
    problem, apart, size = refiner.problem, options.certainty.doubtful, refiner.region.size
    distances = [rig_distance(state.emitters, answer.emitters, size) for state in others]
    clear = [state for state, distance in zip(others, distances, strict=True) if distance > apart]
    # An answer by squares has not the least robust cost in its place: another number would look better than it is.
    alike = [answer, *(state for state, distance in zip(others, distances, strict=True) if distance <= apart)]
    clear = distinct(sorted(clear, key=refiner.unexplained), apart, size)
    if not clear:
        return []
    every = robust_costs(problem, [*alike, *clear])
    least, costs = min(every[: len(alike)]), every[len(alike) :]
    left = max(refiner.unexplained(answer), ROUNDING**2)
    found = [
        Alternative(
            lights=state.lights(problem),
            cost=cost / least,
            left=refiner.unexplained(state) / left,
            more=len(state.emitters) - len(answer.emitters),
            ruled_out=_ruled_out(refiner, answer, state, findings, options),
        )
        for state, cost in zip(clear, costs, strict=True)
    ]
    return least_bad(found)


def still_apart(
    refiner: Refiner, answer: State, earlier: Sequence[Alternative], later: Sequence[Alternative], apart: float
) -> list[Alternative]:
    """Those of the `earlier` ones that are neither the answer nor among the `later` ones.

    Args:
        apart: how far lights are from their counterparts that are clearly elsewhere, of the scene's size.
    """
    size, rigs = refiner.region.size, [answer.emitters, *map(_emitters, later)]
    return [one for one in earlier if all(rig_distance(_emitters(one), rig, size) > apart for rig in rigs)]


def least_bad(found: Sequence[Alternative]) -> list[Alternative]:
    """Those that are told, in their order."""
    return sorted(found, key=lambda one: one.left)[:TOLD]


def _emitters(one: Alternative) -> tuple[Emitter, ...]:
    return tuple(Emitter.of(light) for light in one.lights)


def _ruled_out(
    refiner: Refiner, answer: State, other: State, findings: Sequence[Finding], options: SearchOptions
) -> bool:
    """Of another number unless that was doubted, and of the same one by the yardstick of rivals."""
    more = len(other.emitters) - len(answer.emitters)
    if more:
        doubt = LightMissing if more > 0 else LightSpare
        return not any(isinstance(finding, doubt) for finding in findings)
    return not as_good(refiner, answer, other, options.rivals)
