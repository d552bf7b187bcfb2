"""A frame's lights with what was predicted of them, as a problem of least squares; see `frame_fit` for its cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.moments import Moments, scores
from rgspipe.fitting.model.problem import ROUNDING, LightProblem
from rgspipe.fitting.search.moves import allowed_share, moved_rig, rig_move
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import EmitterRig
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.tracking.motion import Motion, offset, turns
from rgspipe.machine.sums import total
from rgspipe.optim.levenberg_marquardt import NormalEquations


@dataclass(frozen=True)
class Evidence:
    """What a frame's images tell of the lights of a state, in the D + 3L unknowns of `Motion`.

    Attributes:
        weights: (P, 1) or (P, 3) of squared residuals.
        moments: of the images, with these weights.
        variance: σ².
        units: (D + 3L,) natural units of the unknowns: scene units, rad, and the problem's scale.
    """

    state: State
    weights: Tensor
    moments: Moments
    variance: float
    units: Tensor

    @classmethod
    def of(cls, problem: LightProblem, state: State, reference: Tensor) -> Evidence:
        """At `state`, intensities over `reference` (L,) [W/sr]."""
        weights = PLAIN.at(problem, state.columns, state.intensity)
        moments = problem.moments(state.columns, weights)
        counted = max(1.0, float(total(weights.double().expand(problem.target.shape))))
        size = problem.views.frozen.size
        colours = (reference / problem.scale).repeat_interleave(3)
        units = torch.cat([*(emitter.units(size) for emitter in state.emitters), colours])
        return cls(state, weights, moments, max(ROUNDING**2, moments.cost / counted), units)

    def information(self) -> Tensor:
        """(D + 3L, D + 3L) JᵀJ."""
        return self.moments.information(self.state.intensity) * self.units[:, None] * self.units[None, :]

    def direction(self) -> Tensor:
        """(D + 3L,) −Jᵀr."""
        values, count, intensity = self.moments.values.clone(), self.moments.lights, self.state.intensity
        values[:, :, -1] -= torch.einsum("ckl,lc->ck", values[:, :, :count], intensity)
        return scores(values, self.moments.owners, intensity) * self.units


@dataclass(frozen=True)
class PredictedRig:
    """Lights whose parameters and intensities move together, held by a prediction; f is `inflation`."""

    refiner: Refiner
    predicted: Motion
    inflation: float

    def around(self, state: State) -> _AroundRig:
        """The problem with the noise and the weights that it has at a state."""
        return _AroundRig(self, state, Evidence.of(self.refiner.problem, state, self.predicted.reference))

    @cached_property
    def precision(self) -> Tensor:
        """(D + 3L, D + 3L) C⁻¹."""
        count = self.predicted.unknowns
        return torch.linalg.inv(self.predicted.covariance[:count, :count])

    def away(self, rig: EmitterRig, intensity: Tensor) -> Tensor:
        """(D + 3L,) d, from the prediction."""
        before = self.predicted
        change = (self.refiner.problem.scale * intensity - before.intensity) / before.reference[:, None]
        return torch.cat([offset(before.rig, rig, before.size), change.flatten()])


@dataclass(frozen=True)
class _AroundRig:
    """The problem around a state, with the noise and the weights that it has there."""

    whole: PredictedRig
    state: State
    evidence: Evidence

    @cached_property
    def normal(self) -> NormalEquations:
        whole, state, evidence = self.whole, self.state, self.evidence
        turned = turns(state.emitters, whole.predicted.rig)
        basis = torch.block_diag(turned, torch.eye(whole.predicted.unknowns - len(turned)).double())
        pull = basis.T @ (whole.precision @ whole.away(state.emitters, state.intensity))
        matrix = self._certainty * evidence.information() + basis.T @ whole.precision @ basis
        direction = self._certainty * evidence.direction() - pull
        return NormalEquations(matrix, direction, self._cost(evidence.moments, state.emitters, state.intensity))

    def allowed(self, step: Tensor) -> float:
        return allowed_share(self.state.emitters, step[: self._parameters], self.whole.refiner.limits)

    def moved(self, step: Tensor) -> tuple[EmitterRig, Tensor]:
        refiner, count = self.whole.refiner, self._parameters
        colours = step[count:].reshape(-1, 3) * self.whole.predicted.reference[:, None] / refiner.problem.scale
        rig = moved_rig(self.state.emitters, step[:count], refiner.region)
        return rig, (self.state.intensity + colours).clamp(min=0.0)

    def distance(self, place: tuple[EmitterRig, Tensor]) -> float:
        refiner, (rig, intensity) = self.whole.refiner, place
        change = refiner.problem.scale * (intensity - self.state.intensity) / self.whole.predicted.reference[:, None]
        return max(rig_move(self.state.emitters, rig, refiner.region.size), float(change.abs().max()))

    def evaluated(self, place: tuple[EmitterRig, Tensor]) -> tuple[float, State]:
        refiner, (rig, intensity) = self.whole.refiner, place
        columns = refiner.columns(rig, self.state)
        moments = refiner.problem.moments(columns, self.evidence.weights)
        state = replace(self.state, emitters=rig, columns=columns, intensity=intensity)
        return self._cost(moments, rig, intensity), state

    def _cost(self, moments: Moments, rig: EmitterRig, intensity: Tensor) -> float:
        away = self.whole.away(rig, intensity)
        return self._certainty * float(moments.cost_at(intensity)) + float(away @ self.whole.precision @ away)

    @property
    def _certainty(self) -> float:
        """1 / f²σ²."""
        return 1.0 / (self.evidence.variance * self.whole.inflation**2)

    @property
    def _parameters(self) -> int:
        """D."""
        return sum(emitter.parameters for emitter in self.state.emitters)
