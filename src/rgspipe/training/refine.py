"""Geometry from images: surfels move, stretch, turn and are cut so that edges and gaps render as photographed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from rgspipe.progress import track
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.camera import Camera
from rgspipe.scene.surfels import NO_CLIP, Surfels, turn_in_plane

#: Limits of the coverage thresholds, and how far apart they stay.
LOW_RANGE, HIGH_RANGE, THRESHOLD_GAP = (0.05, 0.7), (0.3, 0.99), 0.1

#: Largest change of a log-scale, down and up, and the range of an opacity's logit.
SHRINK, GROW, LOGIT_RANGE = 1.5, 0.6, (-4.0, 5.0)


@dataclass(frozen=True)
class RefineOptions:
    """How geometry is refined.

    Attributes:
        steps: Adam steps.
        views_per_step: images that a step looks at.
        edge_pixels, interior_pixels: most pixels of an image, on edges and elsewhere; the latter close pinholes.
        subsamples: rays per pixel, squared.
        position_rate, clip_rate: steps of positions and of clip offsets, in surfel spacings.
        log_scale_rate, angle_rate, opacity_rate, clip_angle_rate, threshold_rate: steps of the others.
        seed: of views and pixels.
    """

    steps: int = 140
    views_per_step: int = 5
    edge_pixels: int = 2000
    interior_pixels: int = 1000
    subsamples: int = 3
    position_rate: float = 0.003
    clip_rate: float = 0.001
    log_scale_rate: float = 0.03
    angle_rate: float = 0.02
    opacity_rate: float = 0.05
    clip_angle_rate: float = 0.001
    threshold_rate: float = 0.002
    seed: int = 0


@dataclass(frozen=True)
class RefineView:
    """One training image.

    Attributes:
        camera: its camera.
        image: (pixels, 3).
        radiance: (N, 3) outgoing radiance of the surfels under its light.
        edges: (pixels,) bool.
        peak: what its errors are measured against.
    """

    camera: Camera
    image: Tensor
    radiance: Tensor
    edges: Tensor
    peak: float


@dataclass
class RefineState:
    """Everything a refinement needs to go on: parameters, Adam's moments, steps done."""

    parameters: dict[str, Tensor]
    first: dict[str, Tensor]
    second: dict[str, Tensor]
    step: int = 0
    losses: list[float] = field(default_factory=list)

    @classmethod
    def start(cls, surfels: Surfels) -> RefineState:
        count, coverage = len(surfels), surfels.coverage
        parameters = {
            "offset": torch.zeros(count, 2),
            "log_scales": surfels.scales.log(),
            "angle": torch.zeros(count),
            "logit": torch.logit(surfels.opacities.clamp(0.01, 0.99)),
            "clip_offsets": surfels.clip_offsets.clone(),
            "clip_angles": surfels.clip_angles.clone(),
            "thresholds": torch.tensor([coverage.low, coverage.high]),
        }
        zeros = {name: torch.zeros_like(value) for name, value in parameters.items()}
        return cls(parameters, zeros, {name: value.clone() for name, value in zeros.items()})


def refine(
    surfels: Surfels,
    views: Sequence[RefineView],
    spacing: float,
    options: RefineOptions,
    state: RefineState | None = None,
    checkpoint: Callable[[RefineState], None] | None = None,
) -> tuple[Surfels, RefineState]:
    """Surfels that render the views better, and the state at the end.

    Surfels move in their planes only; their radiance stays what it was, so the light transport must be
    made again afterwards. Views and pixels of a step depend on the seed and the step alone: a refinement
    that goes on from a state ends as one that was never interrupted.

    Args:
        surfels: float32 start; also the reference of the limits when `state` is given.
        spacing: typical distance of neighbours, scene units.
        checkpoint: called with the state after every step.
    """
    state = state or RefineState.start(surfels)
    rates = _rates(options, spacing)
    bar = track(range(state.step, options.steps), "geometry", unit="step")
    for step in bar:
        moved = {name: value.clone().requires_grad_() for name, value in state.parameters.items()}
        loss = _step_loss(build_surfels(surfels, moved), moved["thresholds"], views, options, step)
        loss.backward()
        state.losses.append(float(loss.detach()))
        decay = min(1.0, 3.0 * (1.0 - (step + 1) / (options.steps + 1)))
        for name, value in moved.items():
            state.parameters[name] -= decay * rates[name] * _adam(state, name, value.grad, step + 1)
        _limit(state.parameters, surfels)
        state.step = step + 1
        bar.set_postfix_str(f"loss {sum(state.losses[-20:]) / len(state.losses[-20:]):.2e}", refresh=False)
        if checkpoint is not None:
            checkpoint(state)
    return build_surfels(surfels, state.parameters), state


def build_surfels(base: Surfels, parameters: dict[str, Tensor]) -> Surfels:
    """Surfels from refinement parameters, differentiable; thresholds go into the coverage as numbers."""
    frames = base.frames
    low, high = parameters["thresholds"].detach().tolist()
    return replace(
        base,
        centers=base.centers + torch.einsum("na,nac->nc", parameters["offset"], frames[:, :2]),
        rotations=turn_in_plane(base.rotations, parameters["angle"]),
        scales=parameters["log_scales"].exp(),
        opacities=torch.sigmoid(parameters["logit"]),
        clip_offsets=parameters["clip_offsets"],
        # Clips stay where they are when the ellipse turns inside them.
        clip_angles=parameters["clip_angles"] - parameters["angle"][:, None],
        coverage=replace(base.coverage, low=low, high=high),
    )


def _step_loss(
    surfels: Surfels, thresholds: Tensor, views: Sequence[RefineView], options: RefineOptions, step: int
) -> Tensor:
    chosen = _views_of_step(len(views), options, step)
    generator = torch.Generator().manual_seed(options.seed * 1_000_003 + step)
    origins, directions, ray_view, images, peaks = [], [], [], [], []
    for slot, index in enumerate(chosen):
        view = views[index]
        pixels = _draw_pixels(view.edges, options, generator)
        o, d, _ = view.camera.rays(pixels, options.subsamples)
        origins.append(o.float())
        directions.append(d.float())
        ray_view.append(torch.full((len(o),), slot))
        images.append(view.image[pixels])
        peaks.append(torch.full((len(pixels), 1), view.peak))
    radiance = torch.stack([views[index].radiance for index in chosen])
    rays = (torch.cat(origins), torch.cat(directions), torch.cat(ray_view))
    colours = shade_rays(SurfelBvh(surfels), surfels, thresholds, radiance, *rays)
    rendered = colours.reshape(-1, options.subsamples**2, 3).mean(dim=1)
    return ((rendered - torch.cat(images)) / torch.cat(peaks)).square().mean()


def _views_of_step(count: int, options: RefineOptions, step: int) -> list[int]:
    """Every view comes up once before any comes up again."""
    per_step = min(options.views_per_step, count)
    steps_per_epoch = max(1, count // per_step)
    epoch, place = divmod(step, steps_per_epoch)
    order = torch.randperm(count, generator=torch.Generator().manual_seed(options.seed * 7919 + epoch))
    return order[place * per_step : (place + 1) * per_step].tolist()


def _draw_pixels(edges: Tensor, options: RefineOptions, generator: torch.Generator) -> Tensor:
    parts = []
    for mask, most in ((edges, options.edge_pixels), (~edges, options.interior_pixels)):
        pixels = mask.nonzero()[:, 0]
        parts.append(pixels[torch.randperm(len(pixels), generator=generator)[:most]])
    return torch.cat(parts)


def _rates(options: RefineOptions, spacing: float) -> dict[str, float]:
    return {
        "offset": options.position_rate * spacing,
        "log_scales": options.log_scale_rate,
        "angle": options.angle_rate,
        "logit": options.opacity_rate,
        "clip_offsets": options.clip_rate * spacing,
        "clip_angles": options.clip_angle_rate,
        "thresholds": options.threshold_rate,
    }


def _adam(state: RefineState, name: str, gradient: Tensor, step: int) -> Tensor:
    """Adam's direction (Kingma & Ba 2015), with a floor on the second moment that scales with the gradients.

    A fixed floor would freeze scenes whose images are dim; none would let surfels that were grazed once
    by a single ray step as far as those that every image shows.
    """
    fast, slow = 0.9, 0.98
    state.first[name] = fast * state.first[name] + (1.0 - fast) * gradient
    state.second[name] = slow * state.second[name] + (1.0 - slow) * gradient.square()
    mean = state.first[name] / (1.0 - fast**step)
    spread = (state.second[name] / (1.0 - slow**step)).sqrt()
    floor = 1e-3 * spread.square().mean().sqrt() + 1e-20
    return mean / (spread + floor)


def _limit(parameters: dict[str, Tensor], base: Surfels) -> None:
    start = base.scales.log()
    parameters["log_scales"] = torch.maximum(torch.minimum(parameters["log_scales"], start + GROW), start - SHRINK)
    parameters["logit"].clamp_(*LOGIT_RANGE)
    unclipped = base.clip_offsets >= NO_CLIP
    parameters["clip_offsets"] = torch.where(unclipped, base.clip_offsets, parameters["clip_offsets"])
    low = parameters["thresholds"][0].clamp(*LOW_RANGE)
    high = torch.maximum(parameters["thresholds"][1].clamp(*HIGH_RANGE), low + THRESHOLD_GAP)
    parameters["thresholds"] = torch.stack([low, high])
