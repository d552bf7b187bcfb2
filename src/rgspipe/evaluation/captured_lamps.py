"""Lamps of a capture beside those that were on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.evaluation.rig_errors import match_positions
from rgspipe.fitting.certainty.regions import quantile
from rgspipe.scene.lights import LightRig, PointLight

#: Part of truths that a region is to hold.
REGION = 0.95


def against_truth(
    found: Sequence[PointLight], places: np.ndarray, truth: LightRig, size: float, views: Sequence[View]
) -> dict[str, Any]:
    """How far each lamp is from a true one, and whether its region holds it; JSON values, in the order of the found.

    Of true ones that were missed, whether they are in sight.

    Args:
        found: K lamps.
        places: (K, 3, 3) their covariances, scene units².
        truth: those that were on.
        size: of the scene; `position_error`, and `stated`, what the covariance says of it, are in parts of it.
        views: the photographs, which may show a lamp where their depth leaves it free.
    """
    pairs = match_positions(*(np.stack([light.position.numpy() for light in rig]) for rig in (found, truth)))
    held = {true for _, true in pairs}
    matched = [(found[own], truth[true], places[own]) for own, true in sorted(pairs)]
    return {
        "lamps": len(truth),
        "position_error": [float((a.position - b.position).norm()) / size for a, b, _ in matched],
        "stated": [float(np.sqrt(np.trace(covariance))) / size for _, _, covariance in matched],
        "intensity_ratio": [float(a.intensity.mean() / b.intensity.mean()) for a, b, _ in matched],
        "inside_95": [_inside(a, b, covariance) for a, b, covariance in matched],
        "in_sight": [_in_sight(views, b) for _, b, _ in matched],
        "missed_in_sight": [_in_sight(views, one) for index, one in enumerate(truth) if index not in held],
    }


def _inside(lamp: PointLight, true: PointLight, covariance: np.ndarray) -> bool:
    off = (lamp.position - true.position).double().numpy()
    return bool(off @ np.linalg.solve(covariance, off) <= quantile(REGION, 3))


def _in_sight(views: Sequence[View], lamp: PointLight) -> bool:
    return any(_shows(view, lamp) for view in views)


def _shows(view: View, lamp: PointLight) -> bool:
    """Whether a lamp is in the image and nothing before it; without depth, whether it is in the image."""
    pixel, depth = view.camera.project(lamp.position.double())
    column, row = (int(value) for value in torch.floor(pixel).tolist())
    inside = float(depth) > 0.0 and 0 <= row < view.camera.height and 0 <= column < view.camera.width
    return inside and (view.depth is None or not bool(view.depth[row, column] < depth))
