"""Where the published method begins, and the ball that it keeps lights in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.options import StartOptions
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
        """The nearest point (…, 3) of the ball, along the radius."""
        offset = position - self.center
        distance = offset.norm(dim=-1, keepdim=True)
        inwards = self.center + offset * (self.radius / distance.clamp(min=self.radius))
        return torch.where(distance <= self.radius, position, inwards)

    def at_bound(self, position: Tensor) -> bool:
        """Whether any of the positions (…, 3) is on the edge."""
        return bool(((position - self.center).norm(dim=-1) >= self.radius * (1.0 - 1e-6)).any())


def light_ball(frozen: FrozenScene, prior: LightPrior | None) -> tuple[Ball, float]:
    """The ball of possible positions around the surfels' mean, and the scene's radius."""
    centers = frozen.surfels.centers.double().cpu()
    middle = centers.mean(dim=0)
    scene_radius = float((centers - middle).norm(dim=1).amax())
    farthest = float((prior.positions - middle).norm(dim=1).amax()) if prior is not None else 0.0
    return Ball(middle, max(LIGHT_REACH * farthest, SCENE_REACH * scene_radius)), scene_radius


@dataclass(frozen=True)
class Start:
    """L lights where Adam begins, float64.

    Attributes:
        positions: (L, 3) scene units, in the ball.
        log_intensities: (L, 3) of W/sr.
        axes: (L, 3) of unit length; of no meaning for point lights.
    """

    positions: Tensor
    log_intensities: Tensor
    axes: Tensor


def draw_start(
    ball: Ball, scene_radius: float, prior: LightPrior | None, options: StartOptions, seed: int, count: int = 1
) -> Start:
    """A start of `count` lights; the first of them are those of a smaller count, but for their intensity.

    The mean intensity of the training lights is split evenly over the lights.
    """
    generator = torch.Generator().manual_seed(seed)
    draws = [_draw(generator) for _ in range(count)]
    normals, uniforms, turns = (torch.stack(parts) for parts in zip(*draws, strict=True))
    if options.init == "dataset" and prior is not None:
        positions = prior.positions.mean(dim=0) + prior.positions.std(dim=0, correction=0) * normals
    else:
        positions = ball.center + SPHERE_RADII * scene_radius * _unit(normals)
    positions = ball.project(positions)
    mean = prior.intensities.mean(dim=0) if prior is not None else torch.ones(3, dtype=torch.float64)
    log_intensities = (mean / count).clamp(min=math.exp(-LOG_INTENSITY_LIMIT)).log().expand(count, 3)
    if options.random_intensity:
        log_intensities = log_intensities + uniforms
    axes = _unit(turns)
    if options.aim == "center":
        inwards = ball.center - positions
        # A light in the middle has no way to point to it.
        axes = torch.where(inwards.norm(dim=1, keepdim=True) > 0.0, _unit(inwards), axes)
    return Start(positions, log_intensities.clamp(-LOG_INTENSITY_LIMIT, LOG_INTENSITY_LIMIT), axes)


def _draw(generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
    """What one light takes: a normal (3,), a uniform in ±1 (3,), and a normal (3,) for its axis."""
    normal = torch.randn(3, generator=generator, dtype=torch.float64)
    uniform = 2.0 * torch.rand(3, generator=generator, dtype=torch.float64) - 1.0
    return normal, uniform, torch.randn(3, generator=generator, dtype=torch.float64)


def _unit(vectors: Tensor) -> Tensor:
    return torch.nn.functional.normalize(vectors, dim=-1, eps=1e-300)
