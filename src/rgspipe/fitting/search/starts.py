"""Rigs from which a refinement starts: combinations of candidates, and refined rigs with one candidate more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.fitting.search.combinations import (
    Scored,
    best_apart,
    best_combinations,
    bright_gains,
    candidate_costs,
    explained,
    extensions,
    single_gains,
)
from rgspipe.fitting.search.judge import rig_distance
from rgspipe.fitting.search.refine import State

#: So many times the wanted number of combinations are looked at, as neighbours of the best are much like it.
VARIETY = 40

#: Starts stand this far apart, as a part of the scene's size; spots at one place may differ by TURNED in their axes
#: (the cosine between them).
SEPARATION, TURNED = 0.16, 0.85

Rig = tuple[Emitter, ...]


@dataclass(frozen=True)
class Candidates:
    """Candidates of one kind against one target."""

    problem: LightProblem
    coarse: CoarseImages
    scored: Scored
    shape_free: bool

    @classmethod
    def of(cls, problem: LightProblem, coarse: CoarseImages, shape_free: bool = False) -> Candidates:
        return cls(problem, coarse, Scored.of(problem, coarse), shape_free)

    @property
    def lit(self) -> bool:
        """Whether any candidate explains anything."""
        return bool((single_gains(self.scored) > 0).any())

    def emitters(self, combination: Sequence[int]) -> Rig:
        return tuple(self.coarse.emitter(index, self.shape_free) for index in combination)

    def rigs(self, lights: int, count: int, size: float) -> list[Rig]:
        """At most `count` rigs of `lights` candidates each that explain most, clearly different ones, best first.

        Of single spots those that explain most of dim and bright parts alike take turns with those of plain squares,
        which a narrow cone's pool decides.
        """
        if lights == 1 and self.coarse.axes is None:
            costs = candidate_costs(self.scored)
            costs = torch.where(costs < 1.0, costs, torch.inf)
            count = min(count, int(costs.isfinite().sum()))
            return [
                self.emitters([k]) for k in best_apart(costs, self.coarse.positions.cpu(), count, SEPARATION * size)
            ]
        combinations = best_combinations(self.scored, self.coarse.positions, lights, VARIETY * count)
        rigs = different((self.emitters(combination) for combination in combinations), count, SEPARATION * size)
        if lights > 1:
            return rigs
        bright = bright_gains(self.problem, self.coarse).topk(min(VARIETY * count, len(self.coarse))).indices
        pools = different((self.emitters([index]) for index in bright.tolist()), count, SEPARATION * size)
        both = [rig for pair in zip_longest(rigs, pools) for rig in pair if rig is not None]
        return different(both, count, SEPARATION * size)

    def extended(self, state: State, count: int, size: float) -> list[Rig]:
        """At most `count` rigs: the lights of a refined one and one candidate more."""
        fixed = torch.stack([self.scored.coarse_of(self.problem, self.coarse, emitter) for emitter in state.emitters])
        return self._extended(state, extensions(self.scored, fixed), count, size)

    def promised(self, state: State, searched: LightProblem, count: int, size: float) -> tuple[float, list[Rig]]:
        """By what share one candidate more lowers the blocks' squared relative error, and `extended`.

        Args:
            searched: what `state` was refined on; only where its blocks are not the candidates' something is rendered.
        """
        if searched.blocks is None:
            seen = [self.coarse.blocks @ column[:, :, 0].contiguous() for column in state.columns]
        elif searched.blocks.average is self.coarse.blocks:
            seen = [column[:, :, 0] for column in state.columns]
        else:
            seen = [self.coarse.blocks @ self.problem.evaluate(one)[:, :, 0].contiguous() for one in state.emitters]
        fixed = torch.stack([self.scored.weighted(self.problem, self.coarse, image) for image in seen])
        left = 1.0 - explained(self.scored, fixed)
        found = extensions(self.scored, fixed)
        promise = (found[0][1] - (1.0 - left)) / left if left > 0.0 else 0.0
        return promise, self._extended(state, found, count, size)

    def _extended(self, state: State, found: Sequence[tuple[int, float]], count: int, size: float) -> list[Rig]:
        added = [self.emitters([index]) for index, _ in found]
        return [(*state.emitters, *extra) for extra in different(added, count, SEPARATION * size)]


def different(rigs: Sequence[Rig], count: int, separation: float) -> list[Rig]:
    """The first `count` of `rigs` that differ from each other."""
    chosen: list[Rig] = []
    for rig in rigs:
        if all(_apart(rig, other, separation) for other in chosen):
            chosen.append(rig)
        if len(chosen) == count:
            break
    return chosen


def _apart(one: Rig, other: Rig, separation: float) -> bool:
    if rig_distance(one, other) > separation:
        return True
    return any(a.axis is not None and _turn(a, other) < TURNED for a in one)


def _turn(emitter: Emitter, rig: Rig) -> float:
    """The largest cosine between a light's axis and those of another rig."""
    axes: list[Tensor] = [other.axis for other in rig if other.axis is not None]
    return max((float(emitter.axis @ axis) for axis in axes), default=-1.0)
