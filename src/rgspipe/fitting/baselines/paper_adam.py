"""`fit=paper_adam`: the baseline, Adam on positions, log-intensities and axes from one start.

Loss, bounds, learning rates and starts are those of the published method; nothing here is improved on it,
so that it can be compared with.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.baselines.paper_adam_loss import AdamLoss, MovingRig
from rgspipe.fitting.baselines.paper_adam_start import (
    LOG_INTENSITY_LIMIT,
    Ball,
    LightPrior,
    draw_start,
    light_ball,
)
from rgspipe.fitting.certainty.doubts import doubts
from rgspipe.fitting.certainty.uncertainty import light_covariances
from rgspipe.fitting.findings import AllStepsTaken, AtBound
from rgspipe.fitting.meter import Meter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import AdamOptions
from rgspipe.fitting.result import FitResult, Step, dark_result
from rgspipe.fitting.search.refine import State
from rgspipe.fitting.spec import LightSpec
from rgspipe.progress import progress_bar


def fit_paper_adam(
    problem: LightProblem,
    target: Tensor,
    options: AdamOptions,
    prior: LightPrior | None,
    seed: int,
    spec: LightSpec | None = None,
) -> FitResult:
    """A known number of point lights, or of spots with known cones, by Adam.

    Args:
        problem: the same target, for its covariance and effects.
        target: (all pixels, 3), the views' images stacked.
        prior: the training lights; without them the start is drawn from the sphere.
        seed: of the start.
        spec: type and number of the lights, spots' profile; one point light if None.

    Raises:
        ValueError: type, number or cones are not known.
    """
    meter = Meter()
    spec = spec or LightSpec()
    if spec.type == "auto" or spec.count is None or spec.shape_free:
        raise ValueError("PaperAdam needs lights of known kind, number and shape: use Search")
    if problem.black:
        return dark_result(meter.seconds)
    descent = _Descent.create(problem, target, options, prior, seed, spec, meter)
    descent.run()
    return _result(problem, descent)


@dataclass
class _Descent:
    """Adam on one rig, with all steps that it took; the start is the first."""

    loss: AdamLoss
    options: AdamOptions
    ball: Ball
    rig: MovingRig
    meter: Meter
    steps: list[Step]

    @classmethod
    def create(
        cls,
        problem: LightProblem,
        target: Tensor,
        options: AdamOptions,
        prior: LightPrior | None,
        seed: int,
        spec: LightSpec,
        meter: Meter,
    ) -> _Descent:
        ball, scene_radius = light_ball(problem.views.frozen, prior)
        start = draw_start(ball, scene_radius, prior, options, seed, spec.count)
        axes = start.axes.clone().requires_grad_() if spec.aimed else None
        leaves = (leaf.clone().requires_grad_() for leaf in (start.positions, start.log_intensities))
        rig = MovingRig(*leaves, spec.kinds[0], axes)
        loss = AdamLoss(problem.views, target, options.ssim_weight, problem.model.effects)
        return cls(loss, options, ball, rig, meter, [])

    def run(self) -> None:
        """All steps; each one's loss is that of its own lights."""
        options, optimiser = self.options, self._optimiser()
        for _ in progress_bar(range(options.epochs * options.steps), "Adam", unit="step"):
            optimiser.zero_grad()
            loss = self.loss(self.rig)
            self._record(loss)
            loss.backward()
            optimiser.step()
            self._bound()
        with torch.no_grad():
            self._record(self.loss(self.rig))

    def _optimiser(self) -> torch.optim.Adam:
        options, rig = self.options, self.rig
        rates = [(rig.positions, options.position_rate), (rig.log_intensities, options.intensity_rate)]
        rates += [] if rig.axes is None else [(rig.axes, options.axis_rate)]
        return torch.optim.Adam([{"params": [leaf], "lr": rate} for leaf, rate in rates])

    def _record(self, loss: Tensor) -> None:
        self.steps.append(Step(float(loss.detach()), self.rig.lights(), self.meter.seconds))

    @torch.no_grad()
    def _bound(self) -> None:
        """Positions back into the ball, log-intensities into their range, axes to unit length."""
        rig = self.rig
        rig.positions.copy_(self.ball.project(rig.positions))
        rig.log_intensities.clamp_(-LOG_INTENSITY_LIMIT, LOG_INTENSITY_LIMIT)
        if rig.axes is not None:
            rig.axes.copy_(torch.nn.functional.normalize(rig.axes, dim=1))


def _result(problem: LightProblem, descent: _Descent) -> FitResult:
    rig, last = descent.rig, descent.steps[-1]
    emitters = rig.emitters()
    intensities = torch.stack([light.intensity for light in last.lights])
    state = State(emitters, tuple(map(problem.evaluate, emitters)), intensities / problem.scale)
    spread = light_covariances(problem, state)
    findings = [
        *([AtBound()] if descent.ball.at_bound(rig.positions.detach()) else []),
        *doubts(last.lights, spread.calibrated, problem.views.frozen.bvh.surfels, problem.views.frozen.size),
        _all_steps(descent),
    ]
    return FitResult(
        lights=last.lights,
        findings=tuple(findings),
        loss=last.loss,
        iterations=len(descent.steps) - 1,
        evaluations=len(emitters) * (len(descent.steps) + 1),
        lights_tried=len(emitters),
        seconds=descent.meter.seconds,
        covariance=spread.calibrated,
        trajectory=tuple(descent.steps),
        noise_covariance=spread.noise,
    )


def _all_steps(descent: _Descent) -> AllStepsTaken:
    """What the last epoch brought: the method takes all of its steps, whether the loss still falls or not."""
    losses = [step.loss for step in descent.steps]
    before = losses[-min(len(losses), descent.options.steps + 1)]
    return AllStepsTaken(len(losses) - 1, losses[-1] / before - 1.0 if before > 0.0 else 0.0)
