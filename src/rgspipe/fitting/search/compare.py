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
from rgspipe.fitting.search.refine import State
from rgspipe.fitting.search.weighting import ROBUST, cauchy_scale


@dataclass(frozen=True)
class Bar:
    """How much a light has to lower the robust cost of the blocks to be there, rather than an error of the model.

    Attributes:
        least: one light more, or a spot in the place of a point light, lowers it by this share …
        doubtful: … and one that lowers it by more than this share may be there, which the answer says.
        faint, least_faint: where a light of the richer rig sends less than `faint` of the image's energy, it is
            `least_faint`: a light too many, which explains what the model gets wrong, is a faint one. Chosen on other
            scenes than it is judged on, see docs/laboratory/number_of_lights.md.
    """

    least: float = 0.2
    doubtful: float = 0.07
    faint: float = 0.12
    least_faint: float = 0.5

    def wanted(self, rich: State) -> float:
        """The share by which `rich` has to lower the cost."""
        energies = light_energies(rich)
        return self.least_faint if min(energies) < self.faint * sum(energies) else self.least

    def passed(self, problem: LightProblem, simple: State, rich: State) -> bool:
        """Whether the light that `rich` has and `simple` has not is there."""
        return drop(problem, simple, rich) >= self.wanted(rich)


@dataclass(frozen=True)
class Likeness:
    """When rigs, and lights of one rig, are the same. Lengths are parts of the scene's size.

    Attributes:
        met: rigs whose lights are within this of each other, and their axes and shapes within as many radians, are on
            their way to the same place.
        merged, least_energy: lights of one kind that end closer than `merged` are one, and a light with less than
            `least_energy` of the image's energy is none; where the number of lights is not known.
    """

    met: float = 0.01
    merged: float = 0.03
    least_energy: float = 0.01

    def distinct(self, states: Sequence[State], size: float) -> list[State]:
        """The rigs without those that met one before them."""
        kept: list[State] = []
        for state in states:
            if not any(self._met(state.emitters, other.emitters, size) for other in kept):
                kept.append(state)
        return kept

    def worth_keeping(self, state: State, size: float) -> list[int]:
        """Indices of the lights that send enough of the image's energy and do not coincide with a brighter one."""
        energies = light_energies(state)
        kept: list[int] = []
        for index in sorted(range(len(energies)), key=lambda k: -energies[k]):
            emitter = state.emitters[index]
            twins = [
                other
                for other in kept
                if state.emitters[other].light.kind == emitter.light.kind
                and float((state.emitters[other].position - emitter.position).norm()) < self.merged * size
            ]
            if not twins and energies[index] >= self.least_energy * sum(energies):
                kept.append(index)
        return sorted(kept)

    def _met(self, one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> bool:
        """Whether each light of a rig is where its counterpart is."""
        if len(one) != len(other):
            return False
        pairs = _counterparts(one, other)
        return all(a.light.kind == b.light.kind and a.distance(b, size) < self.met for a, b in pairs)


def robust_losses(problem: LightProblem, states: Sequence[State]) -> list[Tensor]:
    """(P,) Cauchy loss of each pixel for each rig, relative to brightness, at the scale of the rig that fits best."""
    return _losses_and_scale(problem, states)[0]


def robust_costs(problem: LightProblem, states: Sequence[State]) -> list[float]:
    """The mean of `robust_losses` of each rig, no less than that of rounding, below which no rig is the better one."""
    losses, scale = _losses_and_scale(problem, states)
    rounding = math.log1p((ROUNDING / scale) ** 2)
    return [max(float(loss.mean()), rounding) for loss in losses]


def _losses_and_scale(problem: LightProblem, states: Sequence[State]) -> tuple[list[Tensor], float]:
    base = ROBUST.base(problem)
    residuals = [base * problem.residual(state.columns, state.intensity) for state in states]
    scale = min(cauchy_scale(residual) for residual in residuals)
    return [(residual.double() / scale).square().log1p().mean(dim=1) for residual in residuals], scale


def ranked(problem: LightProblem, states: Sequence[State]) -> list[State]:
    """The rigs by their robust losses, best first."""
    losses = [float(loss.mean()) for loss in robust_losses(problem, states)]
    return [states[index] for index in sorted(range(len(states)), key=losses.__getitem__)]


def best_state(problem: LightProblem, states: Sequence[State]) -> State:
    """The rig with the least robust loss."""
    return ranked(problem, states)[0]


def drop(problem: LightProblem, simple: State, rich: State) -> float:
    """By what share the robust cost of `rich` is below that of `simple`."""
    before, after = robust_costs(problem, [simple, rich])
    return 1.0 - after / before


def rig_distance(one: Sequence[Emitter], other: Sequence[Emitter]) -> float:
    """The largest distance of a light from its counterpart, scene units; infinite where the numbers differ."""
    if len(one) != len(other):
        return math.inf
    return max(float((first.position - second.position).norm()) for first, second in _counterparts(one, other))


def _counterparts(one: Sequence[Emitter], other: Sequence[Emitter]) -> list[tuple[Emitter, Emitter]]:
    """The lights of one rig, each with one of another of as many lights, such that they are closest together."""
    if len(one) == 1:
        return [(one[0], other[0])]
    first, second = (torch.stack([emitter.position for emitter in rig]).numpy() for rig in (one, other))
    rows, columns = linear_sum_assignment(np.linalg.norm(first[:, None] - second[None], axis=-1))
    return [(one[row], other[column]) for row, column in zip(rows, columns, strict=True)]


def energy_shares(state: State) -> list[float]:
    """`light_energies` over their sum."""
    energies = light_energies(state)
    return [energy / max(sum(energies), 1e-300) for energy in energies]


def light_energies(state: State) -> list[float]:
    """What each light sends into the image, summed over its pixels and colours."""
    return [
        float((column[:, :, 0] * strength.to(column)).double().sum())
        for column, strength in zip(state.columns, state.intensity, strict=True)
    ]
