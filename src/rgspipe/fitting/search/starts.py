"""Rigs from which a refinement starts: combinations of candidates, and refined rigs with one candidate more."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import CombinationOptions
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
from rgspipe.fitting.search.compare import rig_distance
from rgspipe.fitting.search.refine import State

EmitterRig = tuple[Emitter, ...]


@dataclass(frozen=True)
class Candidates:
    """Candidates of one kind against one target."""

    problem: LightProblem
    coarse: CoarseImages
    scored: Scored
    shape_free: bool
    options: CombinationOptions = field(default_factory=CombinationOptions)

    @classmethod
    def of(
        cls,
        problem: LightProblem,
        coarse: CoarseImages,
        shape_free: bool = False,
        options: CombinationOptions | None = None,
    ) -> Candidates:
        return cls(problem, coarse, Scored.of(problem, coarse), shape_free, options or CombinationOptions())

    @property
    def aimed(self) -> bool:
        """Whether they have an axis."""
        return self.coarse.axes is not None

    @property
    def lit(self) -> bool:
        """Whether any candidate explains anything."""
        return bool((single_gains(self.scored) > 0).any())

    def emitters(self, combination: Sequence[int]) -> EmitterRig:
        return tuple(self.coarse.emitter(index, self.shape_free) for index in combination)

    def rigs(self, lights: int, count: int, size: float) -> list[EmitterRig]:
        """At most `count` rigs of `lights` candidates each that explain most, clearly different ones, best first.

        Of single spots those that explain most of dim and bright parts alike take turns with those of plain squares,
        which a narrow cone's pool decides.
        """
        if lights == 1 and not self.aimed:
            costs = candidate_costs(self.scored)
            costs = torch.where(costs < 1.0, costs, torch.inf)
            count = min(count, int(costs.isfinite().sum()))
            apart = self.options.separation * size
            return [self.emitters([k]) for k in best_apart(costs, self.coarse.positions.cpu(), count, apart)]
        looked_at = self.options.beam * count
        combinations = best_combinations(self.scored, self.coarse.positions, lights, looked_at, self.options)
        rigs = self._different((self.emitters(combination) for combination in combinations), count, size)
        if lights > 1:
            return rigs
        bright = bright_gains(self.problem, self.coarse).topk(min(looked_at, len(self.coarse))).indices
        pools = self._different((self.emitters([index]) for index in bright.tolist()), count, size)
        both = [rig for pair in zip_longest(rigs, pools) for rig in pair if rig is not None]
        return self._different(both, count, size)

    def extended(self, state: State, count: int, size: float) -> list[EmitterRig]:
        """At most `count` rigs: the lights of a refined one and one candidate more."""
        fixed = torch.stack([self.scored.coarse_of(self.problem, self.coarse, emitter) for emitter in state.emitters])
        return self._extended(state, extensions(self.scored, fixed, self.options.beam), count, size)

    def promised(self, state: State, searched: LightProblem, count: int, size: float) -> tuple[float, list[EmitterRig]]:
        """By what share one candidate more lowers the blocks' squared relative error, and `extended`.

        Args:
            searched: what `state` was refined on; only where its blocks are not the candidates' something is rendered.
        """
        if searched.model.average is None:
            seen = [self.coarse.blocks @ column[:, :, 0].contiguous() for column in state.columns]
        elif searched.model.average is self.coarse.blocks:
            seen = [column[:, :, 0] for column in state.columns]
        else:
            seen = [self.coarse.blocks @ self.problem.evaluate(one)[:, :, 0].contiguous() for one in state.emitters]
        seen = seen[: len(state.emitters)]
        fixed = torch.stack([self.scored.weighted(self.problem, self.coarse, image) for image in seen])
        left = 1.0 - explained(self.scored, fixed)
        found = extensions(self.scored, fixed, self.options.beam)
        promise = (found[0][1] - (1.0 - left)) / left if left > 0.0 else 0.0
        return promise, self._extended(state, found, count, size)

    def _extended(self, state: State, found: Sequence[tuple[int, float]], count: int, size: float) -> list[EmitterRig]:
        added = [self.emitters([index]) for index, _ in found]
        return [(*state.emitters, *extra) for extra in self._different(added, count, size)]

    def _different(self, rigs: Iterable[EmitterRig], count: int, size: float) -> list[EmitterRig]:
        """The first `count` of `rigs` that differ from each other."""
        chosen: list[EmitterRig] = []
        for rig in rigs:
            if all(self._apart(rig, other, size) for other in chosen):
                chosen.append(rig)
            if len(chosen) == count:
                break
        return chosen

    def _apart(self, one: EmitterRig, other: EmitterRig, size: float) -> bool:
        if rig_distance(one, other, size) > self.options.separation:
            return True
        return any(a.axis is not None and _turn(a, other) < math.cos(self.coarse.spacing) for a in one)


def _turn(emitter: Emitter, rig: EmitterRig) -> float:
    """The largest cosine between a light's axis and those of another rig."""
    axes: list[Tensor] = [other.axis for other in rig if other.axis is not None]
    return max((float(emitter.axis @ axis) for axis in axes), default=-1.0)
