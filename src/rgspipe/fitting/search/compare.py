"""How well rigs explain a target, one against the other: which is best, whether a light is worth it, which are one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.options import BarOptions
from rgspipe.fitting.search.refine import State
from rgspipe.fitting.search.weighting import ROBUST, cauchy_scale
from rgspipe.machine.sums import average, total


@dataclass(frozen=True)
class Wanted:
    """By what share a light has to lower the robust cost to be there.

    Attributes:
        share: it.
        setting: which number of `SearchOptions` that is.
    """

    share: float
    setting: str


def wanted(rich: State, bar: BarOptions) -> Wanted:
    """What is wanted of `rich` for its lights to be there."""
    energies = light_energies(rich)
    if min(energies) < bar.faint * sum(energies):
        return Wanted(bar.least_faint, "bar.least_faint")
    return Wanted(bar.least, "bar.least")


def passed(problem: LightProblem, simple: State, rich: State, bar: BarOptions) -> bool:
    """Whether the light that `rich` has and `simple` has not is there."""
    return drop(problem, simple, rich) >= wanted(rich, bar).share


def distinct(states: Sequence[State], met: float, size: float) -> list[State]:
    """The rigs without those that met one before them; see `ScheduleOptions.met`."""
    kept: list[State] = []
    for state in states:
        if not any(_met(state.emitters, other.emitters, met, size) for other in kept):
            kept.append(state)
    return kept


def _met(one: Sequence[Emitter], other: Sequence[Emitter], met: float, size: float) -> bool:
    """Whether each light of a rig is where its counterpart is."""
    if len(one) != len(other):
        return False
    pairs = counterparts(one, other, size)
    return all(a.light.same_sort(b.light) and a.distance(b, size) < met for a, b in pairs)


def worth_keeping(state: State, bar: BarOptions, met: float, size: float) -> list[int]:
    """Indices of the lights that send enough of the image's energy and did not meet brighter ones of their kind."""
    energies = light_energies(state)
    kept: list[int] = []
    for index in sorted(range(len(energies)), key=lambda k: -energies[k]):
        emitter = state.emitters[index]
        twins = [
            other
            for other in kept
            if state.emitters[other].light.kind == emitter.light.kind
            and _distance(state.emitters[other], emitter, size) < met
        ]
        if not twins and energies[index] >= bar.least_energy * sum(energies):
            kept.append(index)
    return sorted(kept)


def robust_losses(problem: LightProblem, states: Sequence[State]) -> list[Tensor]:
    """(P,) Cauchy loss of each pixel for each rig, relative to brightness, at the scale of the rig that fits best."""
    return _losses_and_scale(problem, states)[0]


def robust_costs(problem: LightProblem, states: Sequence[State]) -> list[float]:
    """The mean of `robust_losses` of each rig, no less than that of rounding, below which no rig is the better one."""
    losses, scale = _losses_and_scale(problem, states)
    rounding = math.log1p((ROUNDING / scale) ** 2)
    return [max(float(average(loss)), rounding) for loss in losses]


def _losses_and_scale(problem: LightProblem, states: Sequence[State]) -> tuple[list[Tensor], float]:
    base = ROBUST.base(problem)
    residuals = [base * problem.residual(state.columns, state.intensity) for state in states]
    scale = min((cauchy_scale(problem, residual) for residual in residuals), default=1.0)
    return [(residual.double() / scale).square().log1p().mean(dim=1) for residual in residuals], scale


def ranked(problem: LightProblem, states: Sequence[State]) -> list[State]:
    """The rigs by their robust losses, best first; none of none."""
    losses = [float(average(loss)) for loss in robust_losses(problem, states)]
    return [states[index] for index in sorted(range(len(states)), key=losses.__getitem__)]


def best_state(problem: LightProblem, states: Sequence[State]) -> State:
    """The rig with the least robust loss."""
    return ranked(problem, states)[0]


def drop(problem: LightProblem, simple: State, rich: State) -> float:
    """By what share the robust cost of `rich` is below that of `simple`."""
    before, after = robust_costs(problem, [simple, rich])
    return 1.0 - after / before


def rig_distance(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> float:
    """The largest distance of a light from its counterpart, over the scene's size; infinite where numbers differ."""
    if len(one) != len(other):
        return math.inf
    return max(_distance(first, second, size) for first, second in counterparts(one, other, size))


def _distance(one: Emitter, other: Emitter, size: float) -> float:
    """Between two lights, over the scene's size; of lights at infinity rad."""
    apart = float((one.light.standing(size) - other.light.standing(size)).norm())
    return apart / size if size > 0.0 else 0.0


def counterparts(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> list[tuple[Emitter, Emitter]]:
    """The lights of one rig, each with one of another of as many lights, such that they are closest together."""
    return [(one[first], other[second]) for first, second in places_of_counterparts(one, other, size)]


def places_of_counterparts(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> list[tuple[int, int]]:
    """The indices of `counterparts` in their rigs."""
    if len(one) == 1:
        return [(0, 0)]
    first, second = (torch.stack([emitter.light.standing(size) for emitter in rig]).numpy() for rig in (one, other))
    rows, columns = linear_sum_assignment(np.linalg.norm(first[:, None] - second[None], axis=-1))
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def energy_shares(state: State) -> list[float]:
    """`light_energies` over their sum."""
    energies = light_energies(state)
    return [energy / max(sum(energies), 1e-300) for energy in energies]


def light_energies(state: State) -> list[float]:
    """What each light sends into the image, summed over its pixels and colours."""
    return column_energies(state)[: len(state.emitters)]


def column_energies(state: State) -> list[float]:
    """`light_energies`, and likewise of the known images behind the lights."""
    return [
        float(total((column[:, :, 0] * strength.to(column)).double()))
        for column, strength in zip(state.columns, state.intensity, strict=True)
    ]
