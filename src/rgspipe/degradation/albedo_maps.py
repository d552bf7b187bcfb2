"""Albedo maps as methods predict them from photographs: wrong alike wherever a surface is seen, each of a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.degradation.model_error import ALBEDO_LENGTH, smooth_field


def with_predicted_albedo(views: Sequence[View], deviation: float, seed: int) -> tuple[View, ...]:
    """The views with albedo maps whose logarithm is off by a field over the scene and a shift a view.

    A method takes shading for paint in all photographs of a wall alike, so that the mean of many is as wrong as one.
    Both errors have the same `deviation`; the field is smooth over ALBEDO_LENGTH of the scene and different in each
    channel. Views without an albedo map or depth stay as they are.
    """
    mapped = [index for index, view in enumerate(views) if view.albedo is not None and view.depth is not None]
    if not mapped:
        return tuple(views)
    places = {index: _places(views[index]) for index in mapped}
    everywhere = torch.cat([part[part.isfinite().all(dim=1)] for part in places.values()])
    size = float((everywhere.amax(dim=0) - everywhere.amin(dim=0)).amax())
    predicted = list(views)
    for index in mapped:
        # The same waves for each view: the field is of the scene.
        waves = torch.Generator().manual_seed(seed)
        field = smooth_field(places[index].nan_to_num(0.0, 0.0, 0.0), ALBEDO_LENGTH * size, 3, waves)
        shift = np.random.default_rng([seed, index, 4]).standard_normal()
        albedo = views[index].albedo
        factor = (deviation * (field + shift)).exp().reshape(albedo.shape)
        predicted[index] = replace(views[index], albedo=(albedo * factor).clamp(max=1.0).to(albedo))
    return tuple(predicted)


def _places(view: View) -> Tensor:
    """(H · W, 3) float64 of what each pixel shows; not finite where that is nothing."""
    origins, directions, lengths = view.camera.rays()
    return origins + (lengths * view.depth.double().reshape(-1))[:, None] * directions
