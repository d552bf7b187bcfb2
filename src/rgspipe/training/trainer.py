"""Surfel training: materials, then geometry, then materials again, with global illumination throughout."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.view_weights import build_view_weights
from rgspipe.scene.surfels import Surfels
from rgspipe.training.checkpoint import Checkpoint
from rgspipe.training.initialise import Footprint
from rgspipe.training.materials import MaterialOptions, Materials, PriorOf, fit_materials
from rgspipe.training.record import Record
from rgspipe.training.refine import RefineOptions, RefineState, RefineView, refine


@dataclass(frozen=True)
class TrainOptions(MaterialOptions):
    """How surfels are trained: their materials, before and after the geometry, and the geometry.

    Attributes:
        refine: of the geometry; its `steps` may be 0.
    """

    refine: RefineOptions = field(default_factory=RefineOptions)


@dataclass(frozen=True)
class Trained:
    """The trained surfels and how training went."""

    surfels: Surfels
    records: tuple[Record, ...]


def train(
    surfels: Surfels,
    views: Sequence[View],
    options: TrainOptions,
    checkpoint: Checkpoint | None = None,
    prior: PriorOf | None = None,
) -> Trained:
    """Fit materials and geometry of `surfels` to `views` with known lights.

    Args:
        surfels: where to start; their albedo is a guess.
        views: training views, each with its light.
        checkpoint: where to keep what is done; an interrupted training goes on from there and ends with
            the surfels of an uninterrupted one.
        prior: known albedo that materials are pulled to.
    """
    log = _Log(checkpoint.records if checkpoint else [])
    surfels = surfels.to(torch.float32)
    spacing = surfel_spacing(surfels)
    if checkpoint is not None and (found := checkpoint.load(surfels)) is not None:
        surfels, radiance, state = found
    else:
        surfels, radiance, state = *_fit_materials(surfels, views, options, log, "materials", prior), None
    if options.refine.steps > 0:
        bvh = SurfelBvh(surfels)
        refined = [_refine_view(view, bvh, radiance[v]) for v, view in enumerate(views)]

        def keep(progress: RefineState) -> None:
            log.steps(progress)
            if checkpoint is not None and checkpoint.is_due(progress.step):
                checkpoint.save(surfels, radiance, progress, log.records)

        if checkpoint is not None and state is None:
            checkpoint.save(surfels, radiance, None, log.records)
        surfels, _ = refine(surfels, refined, spacing, options.refine, state, keep)
        surfels, radiance = _fit_materials(surfels, views, options, log, "final materials", prior)
    return Trained(surfels, tuple(log.records))


def surfel_spacing(surfels: Surfels) -> float:
    """Typical distance of neighbours: initialisation makes the softness of clips a fixed part of it."""
    return surfels.coverage.clip_softness / Footprint.clip_softness


def _fit_materials(
    surfels: Surfels, views: Sequence[View], options: TrainOptions, log: _Log, phase: str, prior: PriorOf | None
) -> tuple[Surfels, Tensor]:
    """Surfels with fitted albedo, and their radiance (V, N, 3) under every view's light."""
    fitted = fit_materials(surfels, views, options, prior=prior)
    log.materials(phase, views, fitted)
    return fitted.surfels, fitted.radiance


def _refine_view(view: View, bvh: SurfelBvh, radiance: Tensor) -> RefineView:
    image = view.image.reshape(-1, 3).float()
    weights = build_view_weights(bvh, view.camera, supersampling=1)
    peak = float(torch.quantile(image, 0.995).clamp(min=1e-12))
    return RefineView(view.camera, image, radiance, weights.edges, peak)


class _Log:
    """The training table as it grows."""

    def __init__(self, records: list[Record]) -> None:
        self.records = list(records)
        self._start = time.monotonic() - (self.records[-1].seconds if self.records else 0.0)

    def steps(self, state: RefineState) -> None:
        loss = state.losses[-1]
        self._add("geometry", state.step, loss, -10.0 * float(np.log10(max(loss, 1e-30))))

    def materials(self, phase: str, views: Sequence[View], fitted: Materials) -> None:
        errors = []
        for view, render in zip(views, fitted.renders, strict=True):
            image = view.image.reshape(-1, 3)
            peak = torch.quantile(image, 0.995).clamp(min=1e-12)
            errors.append(float(((render - image) / peak).square().mean()))
        psnr = float(np.mean([-10.0 * np.log10(max(error, 1e-30)) for error in errors]))
        self._add(phase, 0, float(np.mean(errors)), psnr)

    def _add(self, phase: str, step: int, loss: float, psnr: float) -> None:
        self.records.append(Record(phase, step, loss, psnr, time.monotonic() - self._start))
