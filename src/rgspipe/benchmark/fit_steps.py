"""Times of the steps of a fit, and of the shortcuts that they stand on against the long way."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from rgspipe.evaluation.timing import Timing, measure
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.views import prepare_views
from rgspipe.renderer.effects import ALL_EFFECTS
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import SurfelModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.radiosity import solve_radiosity
from rgspipe.renderer.sparse import stack
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, PointLight

#: Step of the central differences that the analytic derivative is compared with, as a fraction of the scene's size.
DIFFERENCE_STEP = 1e-3

#: Views of the step with several large ones.
MANY = 8


def fit_steps(frozen: FrozenScene, small: Camera, large: Camera, position: Tensor, repetitions: int) -> list[Timing]:
    """Every step of a fit, the building of view weights, and the long ways.

    Args:
        frozen: the scene, with its gather operator.
        small, large: cameras of the views, 128² and 256² in the tables.
        position: (3,) of the light.
    """
    view, wide = frozen.view(small), frozen.view(large)
    irradiance, slope = frozen.unit_irradiance(position[None])
    lightings = torch.cat([irradiance.T, slope[0]], dim=1)
    radiance = frozen.radiance(lightings).reshape(len(frozen.surfels), -1)
    albedo = frozen.surfels.albedo.contiguous()
    direct = albedo * irradiance[0, :, None]
    pixels = prepare_views(frozen, [view])
    soft, sharp = SurfelModel.of(pixels, ALL_EFFECTS), PixelModel.of(pixels, ALL_EFFECTS)
    many = stack([wide.operator] * MANY)
    steps: dict[str, Callable[[], object]] = {
        "irradiance and derivative": lambda: frozen.unit_irradiance(position[None]),
        "patch transport of four lightings": lambda: frozen.radiance(lightings),
        "view product": lambda: view.operator @ radiance,
        "image and analytic derivative": lambda: soft.columns(Emitter(PointLight(position, 1.0))),
        "… with direct light at pixels": lambda: sharp.columns(Emitter(PointLight(position, 1.0))),
        "forward and backward, one 128² view": lambda: forward_and_backward(frozen, [view], position),
        f"forward and backward, {MANY} 256² views": lambda: _many_views(frozen, many, position),
        "image by central differences": lambda: _central_differences(frozen, view, position),
        "full gather solve of one lighting": lambda: solve_radiosity(frozen.gather, albedo, direct, tolerance=1e-3),
        "view weights 128²": lambda: frozen.view(small),
        "view weights 256²": lambda: frozen.view(large),
    }
    return [measure(name, step, repetitions) for name, step in steps.items()]


def forward_and_backward(frozen: FrozenScene, views: list[ViewWeights], position: Tensor) -> Tensor:
    """(3,) gradient of the views' mean square towards the light's position, by autograd."""
    leaf = position.float().clone().requires_grad_()
    rig = (PointLight(leaf, torch.ones(3)),)
    radiance = frozen.radiance_of(rig)
    sum((view.operator @ radiance).square().mean() for view in views).backward()
    return leaf.grad


def _many_views(frozen: FrozenScene, operator: object, position: Tensor) -> Tensor:
    leaf = position.float().clone().requires_grad_()
    radiance = frozen.radiance_of((PointLight(leaf, torch.ones(3)),))
    (operator @ radiance).square().mean().backward()
    return leaf.grad


def _central_differences(frozen: FrozenScene, view: ViewWeights, position: Tensor) -> list[Tensor]:
    """The image and its derivatives by six more images: what a renderer without derivatives has to do."""
    step = DIFFERENCE_STEP * frozen.size * torch.eye(3)
    positions = torch.cat([position[None], position + step, position - step])
    return [view.operator @ frozen.radiance(frozen.unit_irradiance(p[None])[0].T)[:, :, 0] for p in positions]
