"""Geometry from images: surfels move, lean, stretch, turn and are cut so that they render as photographed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean

import torch
from torch import Tensor

from rgspipe.machine.sums import average
from rgspipe.progress import progress_bar
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.camera import Camera
from rgspipe.scene.surfels import Surfels
from rgspipe.training.adam import adam_direction
from rgspipe.training.loss import image_loss
from rgspipe.training.options import RefineOptions
from rgspipe.training.parameters import build_surfels, limit, start_parameters
from rgspipe.training.regularise import Neighbours, continuity, distortion, find_neighbours, normal_smoothness
from rgspipe.training.sampling import PixelDraw, draw_pixels, draw_window, pixel_means, views_of_step
from rgspipe.training.shading import SurfelLight, shaded_radiance

#: Steps that progress shows the mean of.
SHOWN_STEPS = 20

#: Every so many of a step's rays, the depths of hits are compared.
DISTORTION_STRIDE = 16


#: Gradient steps of the parameters by their names in `parameters`; those of IN_SPACINGS are parts of a surfel spacing.
RATES = {
    "offset": 0.003,
    "angle": 0.02,
    "log_scales": 0.03,
    "logit": 0.05,
    "clip_offsets": 0.001,
    "clip_angles": 0.001,
    "albedo": 0.0,
    "thresholds": 0.002,
}
IN_SPACINGS = ("offset", "height", "clip_offsets")


@dataclass(frozen=True)
class RefineView:
    """One training image.

    Attributes:
        camera: its camera.
        image: (pixels, 3).
        alpha: (pixels,).
        light: how its light reaches the surfels.
        edges: (pixels,) bool.
        peak: what its errors are measured against.
        saturated: (pixels, 3) bool, where the image tells only that the scene is at least so bright; None for nowhere.
    """

    camera: Camera
    image: Tensor
    alpha: Tensor
    light: SurfelLight
    edges: Tensor
    peak: float
    saturated: Tensor | None = None

    def as_photographed(self, pixels: Tensor, rendered: Tensor) -> Tensor:
        """Rendered pixels (P, 3), no brighter than the image where that is saturated."""
        if self.saturated is None:
            return rendered
        met = self.saturated[pixels] & (rendered >= self.image[pixels])
        return torch.where(met, self.image[pixels], rendered)


@dataclass
class RefineState:
    """Everything a refinement needs to go on.

    Attributes:
        parameters: as `parameters.start_parameters` names them, relative to the surfels that `refine` is given.
        first, second: Adam's moments of each.
        start_log_scales: (N, 2) of the surfels that training began with.
        step: steps done.
        losses: of every step.
        errors: of every step, the mean squared error of the pixels it looked at, in units of the views' peaks.
    """

    parameters: dict[str, Tensor]
    first: dict[str, Tensor]
    second: dict[str, Tensor]
    start_log_scales: Tensor
    step: int = 0
    losses: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)

    @classmethod
    def start(cls, surfels: Surfels) -> RefineState:
        """That of a refinement which begins with these surfels."""
        parameters = start_parameters(surfels)
        first, second = ({name: torch.zeros_like(value) for name, value in parameters.items()} for _ in range(2))
        return cls(parameters, first, second, surfels.scales.log())

    def rebased(self, surfels: Surfels) -> RefineState:
        """The state that goes on from `surfels`, which `refine` returned with this one."""
        return replace(self, parameters=start_parameters(surfels))

    def of_parts(self, parent: Tensor) -> RefineState:
        """The state of surfels that are parts (M,) of those that it was about; their parameters start anew."""

        def chosen(moments: dict[str, Tensor]) -> dict[str, Tensor]:
            return {name: value if name == "thresholds" else value[parent] for name, value in moments.items()}

        return replace(
            self,
            first=chosen(self.first),
            second=chosen(self.second),
            start_log_scales=self.start_log_scales[parent],
        )


def refine(
    surfels: Surfels,
    views: Sequence[RefineView],
    spacing: float,
    options: RefineOptions,
    state: RefineState | None = None,
    checkpoint: Callable[[RefineState], None] | None = None,
    until: int | None = None,
    after: float = 0.0,
    rates: Mapping[str, float] | None = None,
) -> tuple[Surfels, RefineState]:
    """Surfels that render the views better, and the state at the end.

    Shadows and indirect light stay those of the views' `light`. Views and pixels of a step depend on the seed and
    the step alone: a refinement that goes on from a state ends as one that was never interrupted.

    Args:
        surfels: float32 start, which the state's parameters are relative to.
        spacing: typical distance of neighbours, scene units.
        checkpoint: called with the state after every step.
        until: the step to stop before; all of `options.steps` if None.
        after: seconds of training besides these steps that are left, for the estimate that is shown.
        rates: instead of those in RATES.
    """
    state = state or RefineState.start(surfels)
    rates = _steps(rates or {}, options, spacing)
    pairs = find_neighbours(surfels, spacing)
    last = options.steps if until is None else min(until, options.steps)
    steps = range(state.step, last)
    bar = progress_bar(steps, "geometry", options.steps, unit="step", done=state.step, after=after)
    for step in bar:
        moved = {name: value.clone().requires_grad_(rates[name] > 0.0) for name, value in state.parameters.items()}
        data, prior, error = _step_loss(build_surfels(surfels, moved), moved["thresholds"], views, pairs, options, step)
        (data + prior).backward()
        state.losses.append(float(data.detach()))
        state.errors.append(error)
        decay = min(1.0, 3.0 * (1.0 - (step + 1) / (options.steps + 1)))
        for name, value in moved.items():
            if value.grad is not None:
                direction = adam_direction(state.first[name], state.second[name], value.grad, step + 1)
                state.parameters[name] -= decay * rates[name] * direction
        limit(state.parameters, surfels, state.start_log_scales)
        state.step = step + 1
        bar.set_postfix_str(f"{_shown(state)}, {len(surfels)} surfels", refresh=False)
        if checkpoint is not None:
            checkpoint(state)
    with torch.no_grad():
        return build_surfels(surfels, state.parameters), state


def _shown(state: RefineState) -> str:
    return f"{-10.0 * math.log10(max(fmean(state.errors[-SHOWN_STEPS:]), 1e-30)):.1f} dB"


def _step_loss(
    surfels: Surfels,
    thresholds: Tensor,
    views: Sequence[RefineView],
    pairs: Neighbours,
    options: RefineOptions,
    step: int,
) -> tuple[Tensor, Tensor, float]:
    """What the images say, what the regularisers add, and the mean squared error in units of the views' peaks."""
    generator = torch.Generator().manual_seed(options.seed * 1_000_003 + step)
    chosen = [views[index] for index in views_of_step(len(views), options.views_per_step, options.seed, step)]
    draws = [_draw(view, options, generator) for view in chosen]
    rays = _joined(draws)
    radiance = shaded_radiance(surfels, [view.light for view in chosen])
    bvh = SurfelBvh(surfels)
    colours = shade_rays(bvh, surfels, thresholds, radiance, *rays)
    means = [pixel_means(draw, seen) for draw, seen in zip(draws, _split(draws, colours), strict=True)]
    images = [
        view.as_photographed(draw.pixels, mean[:, :3]) for view, draw, mean in zip(chosen, draws, means, strict=True)
    ]
    data = _image_term(chosen, draws, images, options)
    prior = torch.zeros((), device=radiance.device)
    if options.alpha_weight > 0.0:
        prior = prior + options.alpha_weight * _alpha_term(chosen, draws, [mean[:, 3] for mean in means])
    if options.continuity_weight > 0.0:
        prior = prior + options.continuity_weight * continuity(surfels, pairs)
    if options.smoothness_weight > 0.0:
        prior = prior + options.smoothness_weight * normal_smoothness(surfels, pairs)
    if options.distortion_weight > 0.0:
        origins, directions = rays[0][::DISTORTION_STRIDE], rays[1][::DISTORTION_STRIDE]
        sampled = composite(bvh, origins, directions)
        prior = prior + options.distortion_weight * distortion(surfels, sampled, origins, directions)
    return data, prior, _squared_error(chosen, draws, images)


def _draw(view: RefineView, options: RefineOptions, generator: torch.Generator) -> PixelDraw:
    if options.window > 0:
        return draw_window(view.camera, view.edges, options.window, options.subsamples, generator)
    most = (options.edge_pixels, options.interior_pixels)
    return draw_pixels(view.camera, view.edges, *most, options.subsamples, generator)


def _joined(draws: Sequence[PixelDraw]) -> tuple[Tensor, Tensor, Tensor]:
    """Origins, directions and slots of all rays."""
    slots = [torch.full_like(draw.ray_pixel, slot) for slot, draw in enumerate(draws)]
    origins, directions = torch.cat([d.origins for d in draws]), torch.cat([d.directions for d in draws])
    return origins, directions, torch.cat(slots)


def _split(draws: Sequence[PixelDraw], rays: Tensor) -> Sequence[Tensor]:
    """What belongs to the rays (R, …) of each draw."""
    return rays.split([len(draw.origins) for draw in draws])


def _image_term(
    views: Sequence[RefineView], draws: Sequence[PixelDraw], images: Sequence[Tensor], options: RefineOptions
) -> Tensor:
    terms = []
    for view, draw, rendered in zip(views, draws, images, strict=True):
        pair = (rendered, view.image[draw.pixels])
        if draw.shape is not None:
            pair = tuple(x.reshape(*draw.shape, 3) for x in pair)
        terms.append(image_loss(*pair, view.peak, options, window=draw.shape is not None))
    return torch.stack(terms).mean()


def _squared_error(views: Sequence[RefineView], draws: Sequence[PixelDraw], images: Sequence[Tensor]) -> float:
    triples = zip(views, draws, images, strict=True)
    return fmean(
        float(average(((rendered.detach() - view.image[draw.pixels]) / view.peak).square()))
        for view, draw, rendered in triples
    )


def _alpha_term(views: Sequence[RefineView], draws: Sequence[PixelDraw], covered: Sequence[Tensor]) -> Tensor:
    """Mean |coverage − alpha| of each view's pixels (P,)."""
    triples = zip(views, draws, covered, strict=True)
    return torch.stack([average((own - view.alpha[draw.pixels]).abs()) for view, draw, own in triples]).mean()


def _steps(rates: Mapping[str, float], options: RefineOptions, spacing: float) -> dict[str, float]:
    """The gradient step of each parameter, in its own unit."""
    wanted = {**RATES, "height": options.height_rate, "tilt": options.tilt_rate, **rates}
    return {name: rate * (spacing if name in IN_SPACINGS else 1.0) for name, rate in wanted.items()}
