"""Rigs from which a refinement starts: combinations of candidates, and refined rigs with one candidate more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import zip_longest

import torch

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import CombinationOptions
from rgspipe.fitting.search.apart import CandidatePlaces
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
        """Those of coarse images, ranked for a target."""
        return cls(problem, coarse, Scored.of(problem, coarse), shape_free, options or CombinationOptions())

    @property
    def aimed(self) -> bool:
        """Whether they have an axis."""
        return self.coarse.axes is not None

    @cached_property
    def _places(self) -> CandidatePlaces:
        return CandidatePlaces.of(self.coarse)

    @property
    def lit(self) -> bool:
        """Whether any candidate explains anything."""
        return bool((single_gains(self.scored) > 0).any())

    def emitters(self, combination: Sequence[int]) -> EmitterRig:
        """The lights of a combination, by their numbers."""
        return tuple(self.coarse.emitter(index, self.shape_free) for index in combination)

    def rigs(self, lights: int, count: int, size: float) -> list[EmitterRig]:
        """At most `count` rigs of `lights` candidates each that explain most, clearly different ones, best first.

        Of single spots those that explain most of dim and bright parts alike take turns with those of plain squares,
        which a narrow cone's pool decides.
        """
        apart = self.options.separation * size
        if lights == 1 and not self.aimed:
            costs = candidate_costs(self.scored)
            costs = torch.where(costs < 1.0, costs, torch.inf)
            count = min(count, int(costs.isfinite().sum()))
            return [self.emitters([k]) for k in best_apart(costs, self.coarse.positions.cpu(), count, apart)]
        looked_at = self.options.beam * count
        combinations = best_combinations(self.scored, self.coarse.positions, lights, looked_at, self.options)
        chosen = self._places.first_apart(combinations, count, apart)
        if lights == 1:
            bright = bright_gains(self.problem, self.coarse).topk(min(looked_at, len(self.coarse))).indices
            pools = self._places.first_apart([(index,) for index in bright.tolist()], count, apart)
            both = [one for pair in zip_longest(chosen, pools) for one in pair if one is not None]
            chosen = self._places.first_apart(both, count, apart)
        return [self.emitters(combination) for combination in chosen]

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
        added = self._places.first_apart([(index,) for index, _ in found], count, self.options.separation * size)
        return [(*state.emitters, *self.emitters(extra)) for extra in added]
