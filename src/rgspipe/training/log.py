"""The training table while it is made."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.machine.sums import average
from rgspipe.training.materials import FittedMaterials
from rgspipe.training.operator_store import OperatorBytes
from rgspipe.training.record import Record
from rgspipe.training.refine import RefineState

logger = logging.getLogger(__name__)


class TrainingLog:
    """The training table as it grows, and the size of the views' operators where it was largest.

    Args:
        records: the rows of what was done before.
    """

    def __init__(self, records: list[Record]) -> None:
        self.records, self.stored = list(records), OperatorBytes()
        self._start = time.monotonic() - (self.records[-1].seconds if self.records else 0.0)

    def steps(self, state: RefineState) -> None:
        """Add a row for the newest step of the geometry."""
        self._add("geometry", state.step, state.losses[-1], _decibels(state.errors[-1]))

    def materials(self, phase: str, views: Sequence[View], fitted: FittedMaterials) -> None:
        """Add a row for a fit of the materials, and say how far it is."""
        errors = []
        for view, render in zip(views, fitted.renders, strict=True):
            image = view.image.reshape(-1, 3)
            peak = torch.quantile(image, 0.995).clamp(min=1e-12)
            shown = view.as_photographed(render.reshape(view.image.shape)).reshape(-1, 3)
            errors.append(float(average(((shown - image) / peak).square())))
        self._add(phase, 0, float(np.mean(errors)), float(np.mean([_decibels(error) for error in errors])))
        self.stored = max(self.stored, fitted.stored, key=lambda stored: stored.memory + stored.file)
        last = self.records[-1]
        logger.info(
            "%s: %.1f dB on the training images, %d surfels, %s, %.0f s so far",
            *(phase, last.psnr, len(fitted.surfels), fitted.stored, last.seconds),
        )

    def _add(self, phase: str, step: int, loss: float, psnr: float) -> None:
        self.records.append(Record(phase, step, loss, psnr, time.monotonic() - self._start))


def _decibels(error: float) -> float:
    """PSNR of a mean squared error in units of the peak."""
    return -10.0 * float(np.log10(max(error, 1e-30)))
