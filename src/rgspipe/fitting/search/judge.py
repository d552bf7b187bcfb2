"""How well rigs explain a target, one against the other: which is best, whether another is as good, how many lights."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.refine import State
from rgspipe.fitting.search.weighting import ROBUST, cauchy_scale

#: One more light, or a spot in the place of a point light, must lower the robust cost of the blocks by this share …
LEAST_DROP = 0.2

#: … and one that lowers it by more than this share may be there, which the answer says.
DOUBTFUL_DROP = 0.07

#: A rig with a light that sends less than FAINT of the image's energy must lower the cost by FAINT_DROP: a light too
#: many, which explains what the model gets wrong, is a faint one. Chosen on other scenes than it is judged on, see
#: docs/laboratory/number_of_lights.md.
FAINT, FAINT_DROP = 0.12, 0.5

#: Rigs are clearly different where a light is farther from its counterpart than this part of the scene's size, or
#: where their numbers differ.
CLEARLY_APART = 0.05

#: Rigs whose lights are within this part of the scene's size of each other, and their axes and cones within as many
#: radians, are on their way to the same place.
MET = 0.01

#: Errors of about so many neighbouring pixels are one error: what the model gets wrong is smooth.
PIXELS_PER_ERROR = 25.0

#: Lights of one type that end closer than this part of the scene's size are one, and a light with less than this share
#: of the image's energy is none; where the number of lights is not known.
MERGED, LEAST_ENERGY = 0.03, 0.01

#: Standard deviations between losses within which two rigs are equally good.
EQUALLY_GOOD = 2.0


def robust_losses(problem: LightProblem, states: Sequence[State]) -> list[Tensor]:
    """(P,) Cauchy loss of each pixel for each rig, relative to brightness, at the scale of the rig that fits best."""
    base = ROBUST.base(problem)
    residuals = [base * problem.residual(state.columns, state.intensity) for state in states]
    scale = min(cauchy_scale(residual) for residual in residuals)
    return [(residual.double() / scale).square().log1p().mean(dim=1) for residual in residuals]


def ranked(problem: LightProblem, states: Sequence[State]) -> list[State]:
    """The rigs by their robust losses, best first."""
    losses = [float(loss.mean()) for loss in robust_losses(problem, states)]
    return [states[index] for index in sorted(range(len(states)), key=losses.__getitem__)]


def best_state(problem: LightProblem, states: Sequence[State]) -> State:
    """The rig with the least robust loss."""
    return ranked(problem, states)[0]


def drop(problem: LightProblem, simple: State, rich: State) -> float:
    """By what share the robust cost of `rich` is below that of `simple`."""
    costs = [float(loss.mean()) for loss in robust_losses(problem, [simple, rich])]
    return 1.0 - costs[1] / costs[0] if costs[0] > 0.0 else 0.0


def worth_one_more(problem: LightProblem, simple: State, rich: State) -> bool:
    """Whether the light that `rich` has and `simple` has not is there, rather than an error of the model."""
    energies = light_energies(rich)
    faint = min(energies) < FAINT * sum(energies)
    return drop(problem, simple, rich) >= (FAINT_DROP if faint else LEAST_DROP)


def equally_good(problem: LightProblem, best: State, other: State) -> bool:
    """Whether `other` explains the target as well as `best`, within the spread of what both leave unexplained."""
    one, two = robust_losses(problem, [best, other])
    difference = two - one
    pixels = problem.pixels_each
    errors = max(1.0, float((pixels / PIXELS_PER_ERROR).clamp(max=1.0).sum()))
    return float(difference.mean()) <= EQUALLY_GOOD * float(difference.std()) / math.sqrt(errors)


def rig_distance(one: Sequence[Emitter], other: Sequence[Emitter]) -> float:
    """The largest distance of a light from its counterpart, scene units; infinite where the numbers differ."""
    if len(one) != len(other):
        return math.inf
    return max(float((first.position - second.position).norm()) for first, second in _counterparts(one, other))


def distinct(states: Sequence[State], size: float) -> list[State]:
    """The rigs without those that met one before them."""
    kept: list[State] = []
    for state in states:
        if not any(_met(state.emitters, other.emitters, size) for other in kept):
            kept.append(state)
    return kept


def _met(one: Sequence[Emitter], other: Sequence[Emitter], size: float) -> bool:
    """Whether each light of a rig is within MET of its counterpart."""
    if len(one) != len(other):
        return False
    pairs = _counterparts(one, other)
    return all(a.light.kind == b.light.kind and a.distance(b, size) < MET for a, b in pairs)


def _counterparts(one: Sequence[Emitter], other: Sequence[Emitter]) -> list[tuple[Emitter, Emitter]]:
    """The lights of one rig, each with one of another of as many lights, such that they are closest together."""
    if len(one) == 1:
        return [(one[0], other[0])]
    first, second = (torch.stack([emitter.position for emitter in rig]).numpy() for rig in (one, other))
    rows, columns = linear_sum_assignment(np.linalg.norm(first[:, None] - second[None], axis=-1))
    return [(one[row], other[column]) for row, column in zip(rows, columns, strict=True)]


def worth_keeping(state: State, size: float) -> list[int]:
    """Indices of the lights that send enough of the image's energy and do not coincide with a brighter one."""
    energies = light_energies(state)
    kept: list[int] = []
    for index in sorted(range(len(energies)), key=lambda k: -energies[k]):
        emitter = state.emitters[index]
        twins = [
            other
            for other in kept
            if state.emitters[other].light.kind == emitter.light.kind
            and float((state.emitters[other].position - emitter.position).norm()) < MERGED * size
        ]
        if not twins and energies[index] >= LEAST_ENERGY * sum(energies):
            kept.append(index)
    return sorted(kept)


def light_energies(state: State) -> list[float]:
    """What each light sends into the image, summed over its pixels and colours."""
    return [
        float((column[:, :, 0] * strength.to(column)).double().sum())
        for column, strength in zip(state.columns, state.intensity, strict=True)
    ]
