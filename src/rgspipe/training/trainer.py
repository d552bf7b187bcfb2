"""Surfel training: materials, then geometry, then materials again, with global illumination throughout."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.arguments import as_count, as_one_of, as_several
from rgspipe.completion import with_unseen_surfaces
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.transport import with_albedo
from rgspipe.renderer.view_weights import build_view_weights
from rgspipe.scene.arrays import as_device
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.lights import PointLight
from rgspipe.scene.shapes import Float
from rgspipe.scene.surfels import Surfels
from rgspipe.training.checkpoint import Checkpoint
from rgspipe.training.density import redistributed, surfel_errors
from rgspipe.training.gloss import gloss_radiance
from rgspipe.training.gloss_light import operators_from
from rgspipe.training.initialise import Footprint, initialise_surfels
from rgspipe.training.levels import level
from rgspipe.training.light_refinement import refine_lights
from rgspipe.training.lighting import total_irradiance, trace_lighting
from rgspipe.training.log import TrainingLog
from rgspipe.training.materials import PriorOf, build_frozen, each_view, fit_materials
from rgspipe.training.operator_store import OperatorBytes
from rgspipe.training.options import TrainOptions
from rgspipe.training.photometric import LEAST_ROUGHNESS, fit_heights, fit_normals, roughness
from rgspipe.training.record import Record, materials_seconds
from rgspipe.training.refine import RefineState, RefineView, refine
from rgspipe.training.regularise import find_neighbours
from rgspipe.training.shading import surfel_lights

#: How many surfels a scene gets if nothing else is said.
SURFELS = 10_000


@dataclass(frozen=True, repr=False)
class Trained:
    """The trained surfels and how training went.

    Attributes:
        surfels: as trained.
        records: the training table.
        views: training views, with their lights as refined.
        stored: size of the views' operators, where it was largest.
    """

    surfels: Surfels
    records: tuple[Record, ...]
    views: tuple[View, ...]
    stored: OperatorBytes

    def __repr__(self) -> str:
        last = self.records[-1]
        return f"Trained({self.surfels!r}, {last.psnr:.1f} dB on {len(self.views)} views, {last.seconds:.0f} s)"


def train(
    views: Sequence[View],
    surfels: Surfels | int = SURFELS,
    options: TrainOptions | None = None,
    *,
    checkpoint: Checkpoint | None = None,
    prior: PriorOf | None = None,
    device: torch.device | str | None = None,
) -> Trained:
    """Fit materials and geometry of surfels to views with known lights.

    Args:
        views: training views, each with its light.
        surfels: where to start, albedo is a guess; or how many to make from the depth of the views.
        options: how; the defaults if None.
        checkpoint: where to keep what is done; an interrupted training goes on from there and ends with
            the surfels of an uninterrupted one.
        prior: known albedo that materials are pulled to.
        device: where to compute, and what is trained is; where the surfels are if None.

    Raises:
        InputError: an argument is of another kind; there are no views, or they have no lights, no depth to
            make surfels from, or no such device.
    """
    options = TrainOptions() if options is None else as_one_of(options, TrainOptions, "options", "Pass such.")
    views = as_several(views, View, "views", "rg.load_views reads them.")
    device = None if device is None else as_device(device)
    if checkpoint is not None:
        as_one_of(checkpoint, Checkpoint, "checkpoint", "Pass such, or None.")
    if not (prior is None or callable(prior)):
        expected = "a function of surfels that gives an AlbedoPrior"
        raise InputError("prior", expected=expected, found=repr(prior)[:80], remedy="Pass such, or None.")
    if not isinstance(surfels, Surfels):
        surfels = initialise_surfels(
            views, as_count(surfels, "surfels", remedy="Pass surfels, or how many to make."), seed=options.seed
        )
    if not views:
        raise InputError("views", expected="views to train on", found="none", remedy="rg.load_views reads them.")
    log = TrainingLog(checkpoint.records if checkpoint else [])
    surfels = surfels.to(torch.float32) if device is None else surfels.to(torch.float32).to(device)
    views = [view.to(surfels.centers.device) for view in views]
    spacing, given = spacing_of_clips(surfels), [view.light for view in views]
    most = int(options.growth * len(surfels))
    if checkpoint is not None and (found := checkpoint.load(surfels)) is not None:
        surfels, radiance, state, lights = found
        views = [replace(view, light=light) for view, light in zip(views, lights, strict=True)]
    else:
        # Before the materials: else the albedo of what is seen makes up for light that is lost where nothing is.
        surfels = _closed(surfels, views, options, hidden=options.steps == 0)
        surfels, radiance, views = _fit_materials(surfels, views, given, options, log, "materials", prior)
        centers, state = surfels.centers, None
        for _ in range(options.photometric_rounds):
            turned = _turned_by_shading(surfels, centers, views, radiance, spacing)
            if turned is None:
                break
            surfels, radiance, views = _fit_materials(turned, views, given, options, log, "materials", prior)
    if options.steps > 0:
        if checkpoint is not None and state is None:
            checkpoint.save(surfels, radiance, None, log.records, [view.light for view in views])
        surfels = _refine_geometry(surfels, radiance, state, views, spacing, options, log, checkpoint, most)
        surfels = _closed(_seen(surfels), views, options)
        surfels, _, views = _fit_materials(surfels, views, given, options, log, "final materials", prior)
    return Trained(surfels, tuple(log.records), tuple(views), log.stored)


def _closed(surfels: Surfels, views: Sequence[View], options: TrainOptions, hidden: bool = True) -> Surfels:
    """With surfels on the surfaces that no view shows, if those are wanted."""
    if not options.unseen:
        return surfels
    # What is inside of what is numpy's and scipy's work.
    known = [view.to("cpu") for view in views]
    cameras, depths = [view.camera for view in known], [view.depth for view in known]
    lamps = [view.light.position for view in known if view.light is not None]
    closed = with_unseen_surfaces(surfels.to("cpu"), cameras, lamps, depths, hidden=hidden)
    return closed.to(surfels.centers.device)


def _seen(surfels: Surfels) -> Surfels:
    """Without the surfaces that no view shows."""
    seen, gloss = surfels.guessed == 0.0, surfels.gloss
    kept = {name: tensor[seen] for name, tensor in surfels.tensors().items()}
    return replace(
        surfels, **kept, gloss=None if gloss is None else Gloss(gloss.reflectance[seen], gloss.exponents[seen])
    )


def spacing_of_clips(surfels: Surfels) -> float:
    """Typical distance of neighbours, of which initialisation makes the softness of clips a fixed part."""
    return surfels.coverage.clip_softness / Footprint.clip_softness


def _fit_materials(
    surfels: Surfels,
    views: Sequence[View],
    measured: Sequence[PointLight],
    options: TrainOptions,
    log: TrainingLog,
    phase: str,
    prior: PriorOf | None,
) -> tuple[Surfels, Tensor, Sequence[View]]:
    """Surfels with fitted albedo, their radiance (V, N, 3) under every view's light, and the views with that light."""
    fitted = fit_materials(surfels, views, options, prior=prior)
    log.materials(phase, views, fitted)
    for _ in range(options.light_rounds):
        transport = with_albedo(fitted.prepared.transport, fitted.surfels.albedo)
        bvh = SurfelBvh(fitted.surfels)
        views = refine_lights(bvh, fitted.prepared.weights, transport, views, measured)
        fitted = fit_materials(fitted.surfels, views, options, prior=prior, prepared=fitted.prepared)
        log.materials(f"{phase} and lights", views, fitted)
    return fitted.surfels, fitted.radiance, views


def _turned_by_shading(
    surfels: Surfels, measured: Tensor, views: Sequence[View], radiance: Tensor, spacing: float
) -> Surfels | None:
    """Rough surfels with normals and heights as the shading says; None if depth knows better.

    The linear systems are scipy's, on the CPU.
    """
    device, surfels = surfels.centers.device, surfels.to("cpu")
    pairs = find_neighbours(surfels, spacing)
    if roughness(surfels, pairs) < LEAST_ROUGHNESS:
        return None
    radiance, views = radiance.cpu(), [view.to("cpu") for view in views]
    lights = surfel_lights(surfels, [view.light for view in views], radiance / surfels.albedo.clamp(min=1e-6))
    # Saturated pixels tell as little of shading as edges do, and are left out with them.
    weights = (
        replace(weight, edges=weight.edges | view.saturated.reshape(-1, 3).any(dim=1))
        for weight, view in zip(each_view(surfels, views, supersampling=1), views, strict=True)
    )
    images = [view.image.reshape(-1, 3).float() for view in views]
    turned = fit_normals(surfels, weights, images, lights, pairs)
    return fit_heights(turned, measured.cpu(), find_neighbours(turned, spacing)).to(device)


def _refine_geometry(
    surfels: Surfels,
    radiance: Tensor,
    state: RefineState | None,
    views: Sequence[View],
    spacing: float,
    options: TrainOptions,
    log: TrainingLog,
    checkpoint: Checkpoint | None,
    most: int,
) -> Surfels:
    """All steps of the geometry, in rounds between which surfels split, and shadows and indirect light are made again.

    Args:
        most: surfels at the end.
    """
    state = state or RefineState.start(surfels)
    steps, every = options.steps, options.relight_every or options.steps
    lights, relighting = [view.light for view in views], 0.0

    def keep(progress: RefineState) -> None:
        log.steps(progress)
        # Between two rounds it is what the next one starts from that is kept.
        within = progress.step % every > 0 or progress.step == steps
        if checkpoint is not None and within and checkpoint.is_due(progress.step):
            checkpoint.save(surfels, radiance, progress, log.records, lights)

    while True:
        refined = refine_views(surfels, views, radiance)
        until = (state.step // every + 1) * every
        # Rounds that make light again, and the materials at the end.
        rounds = (steps - 1) // every - state.step // every
        after = rounds * relighting + materials_seconds(log.records)
        surfels_after, state = refine(surfels, refined, spacing, options, state, keep, until, after)
        if state.step >= steps:
            return surfels_after
        began = time.monotonic()
        surfels, radiance = surfels_after, _relit(surfels_after, views, options)
        if options.growth > 1.0:
            surfels, parent = _redistributed(surfels, views, radiance, most)
            radiance, state = _relit(surfels, views, options), state.of_parts(parent)
        state = state.rebased(surfels)
        if checkpoint is not None:
            checkpoint.save(surfels, radiance, state, log.records, lights)
        relighting = time.monotonic() - began


def _redistributed(surfels: Surfels, views: Sequence[View], radiance: Tensor, most: int) -> tuple[Surfels, Tensor]:
    weights = each_view(surfels, views, supersampling=1)
    return redistributed(surfels, surfel_errors(weights, radiance, views), most)


def _relit(surfels: Surfels, views: Sequence[View], options: TrainOptions) -> Tensor:
    """(V, N, 3) radiance under every view's light, by the surfels as they stand."""
    lighting, frozen = trace_lighting(SurfelBvh(surfels), views), build_frozen(surfels, options)
    if surfels.gloss is not None:
        operators = operators_from(surfels, frozen.gather, frozen.transport)
        return gloss_radiance(surfels, lighting, [view.camera for view in views], operators, frozen.transport)
    return total_irradiance(lighting, surfels.albedo, frozen.transport) * surfels.albedo


def refine_views(surfels: Surfels, views: Sequence[View], radiance: Float[Tensor, "V N 3"]) -> list[RefineView]:
    """What a refinement of `surfels` looks at; their radiance says how light bounces."""
    bvh = SurfelBvh(surfels)
    lights = surfel_lights(surfels, [view.light for view in views], radiance / surfels.albedo.clamp(min=1e-6))
    found = []
    for view, light, shown in zip(views, lights, radiance, strict=True):
        image, alpha = view.image.reshape(-1, 3).float(), view.alpha.reshape(-1).float()
        weights = build_view_weights(bvh, view.camera, supersampling=1)
        against = float(level(image, weights.operator @ shown.float()))
        saturated = None if view.saturated_from is None else view.saturated.reshape(-1, 3)
        found.append(RefineView(view.camera, image, alpha, light, weights.edges, against, saturated))
    return found
