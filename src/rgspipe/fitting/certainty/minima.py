"""Regions around an answer that are wide enough for other minima nearby.

A covariance knows of one minimum. Where K others explain the target as well, the truth is in any of them, so what is
known of it is a mixture of K + 1 alike peaks. Its second moments about the answer are

    C + Σ_k δ_k δ_kᵀ / (K + 1) ,

with δ_k how far the k-th is from the answer: each of them lies within √(K + 1) standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search.compare import places_of_counterparts
from rgspipe.fitting.search.refine import State


def holding(
    covariances: Sequence[Tensor], answer: State, others: Sequence[State], scale: float, size: float
) -> tuple[Tensor, ...]:
    """The covariances of an answer's lights, wide enough for other rigs that explain as much.

    Args:
        covariances: of each light, see `FitResult.covariance`; what is infinite in them stays so.
        others: of as many lights.
        scale: of intensities, see `LightProblem`.
    """
    widened = [covariance.clone() for covariance in covariances]
    for other in others:
        for index, place in places_of_counterparts(answer.emitters, other.emitters, size):
            colours = scale * (other.intensity[place] - answer.intensity[index]).double().cpu()
            moved = torch.cat([_moved(answer.emitters[index], other.emitters[place], size), colours])
            moved[torch.isinf(widened[index].diagonal())] = 0.0
            widened[index] += torch.outer(moved, moved) / (len(others) + 1)
    return tuple(widened)


def _moved(one: Emitter, other: Emitter, size: float) -> Tensor:
    """(R,) change of a light's own numbers to those of another; of one of another sort, that of its place alone."""
    same = other.light.like(one.light) if other.light.same_sort(one.light) else one.light.at(other.position)
    return one.spread() @ (one.units(size) * one.offset(replace(one, light=same), size))
