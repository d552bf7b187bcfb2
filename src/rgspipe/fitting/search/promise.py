"""What a light of another kind would explain in the place of one that was found: in closed form, before it is fitted.

With r the residual of an answer, J its derivatives towards all that is free of it, and D what its image changes by as a
light's extent or beam begins, the squared error falls by gᵀS⁻¹g for the part S of DᵀD that J cannot do, and g of Dᵀr.
How much S itself is, over the error that is left, says what the image can tell at all: a change of which S is less than
counts is one that nobody would notice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import ROBUST
from rgspipe.scene import Light
from rgspipe.scene.lights import LedLight

#: Directions of unknowns with less than this part of the most information are not among what can move.
RANK = 1e-9


@dataclass(frozen=True)
class Promise:
    """What K changes of a light's image would do to the squared error.

    Attributes:
        gain: by what share it falls at best.
        signal: by how many times it would have risen, were they there in full, and the light fitted without them.
        best: (K,) how much of each is best.
    """

    gain: float
    signal: float
    best: Tensor


def promised(refiner: Refiner, state: State, index: int, changes: Sequence[Tensor]) -> Promise:
    """What changes (P, 3) of the image of light `index`, of unit intensity, promise; rounding is an error, too."""
    problem, columns = refiner.problem, [*state.columns]
    columns[index] = torch.cat([columns[index], torch.stack([*changes], dim=2).to(columns[index])], dim=2)
    weights = refiner.weights(state, ROBUST)
    moments = problem.moments(columns, weights)
    matrix, direction = moments.parameter_system()
    added = _last_of(columns, index, len(changes))
    left, gains = _beside(matrix, direction, added)
    cost = _no_less_than_rounding(moments.cost, problem, weights)
    best = torch.linalg.pinv(left, rtol=RANK, hermitian=True) @ gains
    return Promise(float(gains @ best) / cost, float(left.sum()) / cost, best)


def comes_near(refiner: Refiner, answer: State, other: State, least: float) -> bool:
    """Whether a full step from `other` leaves so little, to first order, that the answer's is not less by `least`."""
    weights, problem = refiner.weights(answer, ROBUST), refiner.problem
    left = _no_less_than_rounding(problem.moments(answer.columns, weights).cost, problem, weights)
    moments = problem.moments(other.columns, weights)
    matrix, direction = moments.parameter_system()
    scale = _scale(matrix)
    fall = (direction / scale) @ _inverse(matrix, scale) @ (direction / scale)
    return (1.0 - least) * (moments.cost - float(fall)) <= left


def beam_promised(refiner: Refiner, state: State, index: int) -> Promise:
    """What the cosines with the axes promise in the profile of a light that shines alike in all directions.

    A beam of any kind brightens one side and darkens the other, and that is what it does first.
    """
    place, axes = state.emitters[index].position, torch.eye(3).double()
    ahead, behind = ([_image(refiner, LedLight(place, 1.0, sign * axis, 1.0)) for axis in axes] for sign in (1, -1))
    return promised(refiner, state, index, [one - other for one, other in zip(ahead, behind, strict=True)])


def extent_promised(refiner: Refiner, state: State, index: int, sized: Light) -> Promise:
    """What the extent of a `sized` light promises, in the place of its seed."""
    seed = state.columns[index][:, :, 0]
    return promised(refiner, state, index, [_image(refiner, sized) - seed])


def _image(refiner: Refiner, light: Light) -> Tensor:
    """(P, 3) of a light of unit intensity."""
    return refiner.columns((Emitter.of(light),))[0][:, :, 0]


def _last_of(columns: Sequence[Tensor], index: int, count: int) -> Tensor:
    """(D,) bool: the last `count` of a light's parameters, among those of all."""
    counts = [column.shape[2] - 1 for column in columns]
    chosen = torch.zeros(sum(counts), dtype=torch.bool)
    end = sum(counts[: index + 1])
    chosen[end - count : end] = True
    return chosen


def _beside(matrix: Tensor, direction: Tensor, added: Tensor) -> tuple[Tensor, Tensor]:
    """Normal equations of the `added` parameters, with what the others can do taken out."""
    own, cross = matrix[~added][:, ~added], matrix[added][:, ~added]
    scale = _scale(own)
    taken = (cross / scale) @ _inverse(own, scale)
    return matrix[added][:, added] - taken @ (cross / scale).T, direction[added] - taken @ (direction[~added] / scale)


def _scale(matrix: Tensor) -> Tensor:
    """What parameters are divided by so that all of them have as much information."""
    return matrix.diagonal().clamp(min=1e-300).sqrt()


def _inverse(matrix: Tensor, scale: Tensor) -> Tensor:
    """Of the scaled matrix, without directions of which nothing is known."""
    return torch.linalg.pinv(matrix / scale[:, None] / scale[None, :], rtol=RANK, hermitian=True)


def _no_less_than_rounding(cost: float, problem: LightProblem, weights: Tensor) -> float:
    """A squared error, which rounding alone makes as large as this."""
    return max(cost, ROUNDING**2 * float((weights.double() * problem.target.double().square()).sum()), 1e-300)
