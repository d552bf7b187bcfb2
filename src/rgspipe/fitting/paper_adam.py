"""`fit=paper_adam`: the baseline, Adam on position and log-intensity from one start.

Loss, bounds, learning rates and starts are those of the published method; nothing here is improved on it,
so that it can be compared with.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.parameters import Emitter
from rgspipe.fitting.problem import Effects, LightProblem
from rgspipe.fitting.refine import State
from rgspipe.fitting.result import REASONS, FitResult, FitStatus, Step, dark_result
from rgspipe.fitting.ssim import ssim
from rgspipe.fitting.uncertainty import doubts, light_covariances
from rgspipe.fitting.views import PreparedViews
from rgspipe.progress import track
from rgspipe.renderer.direct import differentiable_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight

#: Log-intensities stay within ± this.
LOG_INTENSITY_LIMIT = 30.0

#: The ball of possible positions: this many times the farthest training light …
LIGHT_REACH = 1.5

#: … and at least this many radii of the scene.
SCENE_REACH = 4.0

#: Radius of the sphere of `init=sphere`, in radii of the scene.
SPHERE_RADII = 2.0


@dataclass(frozen=True)
class AdamOptions:
    """The published method's settings.

    Attributes:
        epochs, steps: epochs of so many steps each.
        position_rate: learning rate of the position.
        intensity_rate: learning rate of the log-intensity.
        ssim_weight: λ, the share of structural similarity in the loss.
        init: "dataset" draws the start from the training lights' mean and spread, "sphere" from a sphere.
        random_intensity: whether the first intensity is drawn, too: e^u times its mean, u uniform in ±1.
        patience: stop after so many epochs without a lower loss; None never stops early.
    """

    epochs: int = 25
    steps: int = 50
    position_rate: float = 0.01
    intensity_rate: float = 0.05
    ssim_weight: float = 0.2
    init: str = "dataset"
    random_intensity: bool = False
    patience: int | None = None


@dataclass(frozen=True)
class LightPrior:
    """What the training lights say of an unknown one.

    Attributes:
        positions: (T, 3) of the training lights, scene units.
        intensities: (T, 3) W/sr.
    """

    positions: Tensor
    intensities: Tensor

    @classmethod
    def of(cls, lights: Sequence[PointLight]) -> LightPrior | None:
        """The prior of training lights; None without any."""
        if not lights:
            return None
        positions = torch.stack([light.position.double() for light in lights])
        return cls(positions, torch.stack([light.intensity.double() for light in lights]))


@dataclass(frozen=True)
class Ball:
    """Where a light may be."""

    center: Tensor
    radius: float

    def project(self, position: Tensor) -> Tensor:
        """The nearest point (3,) of the ball, along the radius."""
        offset = position - self.center
        distance = float(offset.norm())
        return position if distance <= self.radius else self.center + offset * (self.radius / distance)

    def at_bound(self, position: Tensor) -> bool:
        return float((position - self.center).norm()) >= self.radius * (1.0 - 1e-6)


def light_ball(frozen: FrozenScene, prior: LightPrior | None) -> tuple[Ball, float]:
    """The ball of possible positions around the surfels' mean, and the scene's radius."""
    centers = frozen.surfels.centers.double().cpu()
    middle = centers.mean(dim=0)
    scene_radius = float((centers - middle).norm(dim=1).amax())
    farthest = float((prior.positions - middle).norm(dim=1).amax()) if prior is not None else 0.0
    return Ball(middle, max(LIGHT_REACH * farthest, SCENE_REACH * scene_radius)), scene_radius


def adam_loss(
    views: PreparedViews, target: Tensor, position: Tensor, log_intensity: Tensor, ssim_weight: float, effects: Effects
) -> Tensor:
    """(1−λ)·mean|M⊙(I − I*)| + λ·(1 − SSIM(M⊙I, M⊙I*)), averaged over the views.

    Args:
        target: (all pixels, 3), the views' images stacked.
        position, log_intensity: (3,), differentiable.
    """
    frozen = views.frozen
    irradiance = differentiable_irradiance(frozen.bvh, position[None], effects.shadows)
    radiance = frozen.radiance(irradiance.T, effects.interreflection)[:, :, 0]
    stacked = (views.all_pixels @ radiance) * log_intensity.exp().to(radiance)
    losses, start = [], 0
    for view, mask in zip(views.views, views.masks, strict=True):
        pixels = slice(start, start + view.camera.pixel_count)
        start = pixels.stop
        shape = (view.camera.height, view.camera.width, 3)
        covered = mask.to(stacked)[:, :, None]
        image, wanted = covered * stacked[pixels].reshape(shape), covered * target[pixels].reshape(shape)
        absolute = (image - wanted).abs().mean()
        losses.append((1.0 - ssim_weight) * absolute + ssim_weight * (1.0 - ssim(image, wanted)))
    return torch.stack(losses).mean()


def fit_paper_adam(
    problem: LightProblem, target: Tensor, options: AdamOptions, prior: LightPrior | None, seed: int
) -> FitResult:
    """One point light by Adam.

    Args:
        problem: the same target, for its covariance and effects.
        target: (all pixels, 3), the views' images stacked.
        prior: the training lights; without them the start is drawn from the sphere.
        seed: of the start.
    """
    begin = time.perf_counter()
    if problem.black:
        return dark_result(time.perf_counter() - begin)
    ball, scene_radius = light_ball(problem.views.frozen, prior)
    position, log_intensity = draw_start(ball, scene_radius, prior, options, seed)
    steps, status = _descend(problem, target, position, log_intensity, ball, options, begin)
    last = steps[-1]
    status = FitStatus.AT_BOUND if ball.at_bound(last.position) else status
    emitter = Emitter(last.position)
    state = State((emitter,), [problem.evaluate(emitter)], last.intensity[None] / problem.scale)
    spread = light_covariances(problem, state)
    doubt = doubts(last.lights, spread.calibrated, problem.views.frozen.size)
    return FitResult(
        lights=last.lights,
        status=status,
        reason=f"{REASONS[status]} {doubt}".rstrip(),
        loss=last.loss,
        iterations=len(steps) - 1,
        evaluations=len(steps) + 1,
        lights_tried=1,
        seconds=time.perf_counter() - begin,
        covariance=spread.calibrated,
        trajectory=tuple(steps),
        noise_covariance=spread.noise,
    )


def draw_start(
    ball: Ball, scene_radius: float, prior: LightPrior | None, options: AdamOptions, seed: int
) -> tuple[Tensor, Tensor]:
    """Position and log-intensity (3,) float64 where Adam begins."""
    generator = torch.Generator().manual_seed(seed)
    normal = torch.randn(3, generator=generator, dtype=torch.float64)
    uniform = 2.0 * torch.rand(3, generator=generator, dtype=torch.float64) - 1.0
    if options.init == "dataset" and prior is not None:
        spread = prior.positions.std(dim=0, correction=0)
        position = prior.positions.mean(dim=0) + spread * normal
    elif options.init in ("dataset", "sphere"):
        direction = normal / normal.norm().clamp(min=1e-12)
        position = ball.center + SPHERE_RADII * scene_radius * direction
    else:
        raise ValueError(f"init must be 'dataset' or 'sphere', got {options.init!r}")
    mean = prior.intensities.mean(dim=0) if prior is not None else torch.ones(3, dtype=torch.float64)
    log_intensity = mean.clamp(min=math.exp(-LOG_INTENSITY_LIMIT)).log()
    if options.random_intensity:
        log_intensity = log_intensity + uniform
    return ball.project(position), log_intensity.clamp(-LOG_INTENSITY_LIMIT, LOG_INTENSITY_LIMIT)


def _descend(
    problem: LightProblem,
    target: Tensor,
    position: Tensor,
    log_intensity: Tensor,
    ball: Ball,
    options: AdamOptions,
    begin: float,
) -> tuple[list[Step], FitStatus]:
    """All steps, the start first; each step's loss is that of its own position and intensity."""
    position, log_intensity = position.clone().requires_grad_(), log_intensity.clone().requires_grad_()
    optimiser = torch.optim.Adam(
        [{"params": [position], "lr": options.position_rate}, {"params": [log_intensity], "lr": options.intensity_rate}]
    )

    def loss_here() -> Tensor:
        return adam_loss(problem.views, target, position, log_intensity, options.ssim_weight, problem.effects)

    def record(loss: Tensor) -> Step:
        seconds = time.perf_counter() - begin
        light = PointLight(position.detach().clone(), log_intensity.detach().exp())
        return Step(float(loss.detach()), (light,), seconds)

    steps: list[Step] = []
    for index in track(range(options.epochs * options.steps), "Adam", unit="step"):
        optimiser.zero_grad()
        loss = loss_here()
        steps.append(record(loss))
        if _stalled(steps, index, options):
            return steps, FitStatus.CONVERGED
        loss.backward()
        optimiser.step()
        with torch.no_grad():
            position.copy_(ball.project(position))
            log_intensity.clamp_(-LOG_INTENSITY_LIMIT, LOG_INTENSITY_LIMIT)
    with torch.no_grad():
        steps.append(record(loss_here()))
    return steps, FitStatus.MAX_ITERATIONS


def _stalled(steps: list[Step], index: int, options: AdamOptions) -> bool:
    """Whether the last `patience` epochs brought no lower loss."""
    if options.patience is None or index < options.patience * options.steps or index == 0:
        return False
    recent = options.patience * options.steps
    return min(step.loss for step in steps[-recent:]) >= min(step.loss for step in steps[:-recent])
