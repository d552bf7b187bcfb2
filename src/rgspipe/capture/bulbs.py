"""Lamps whose own pixels photographs show: the surface behind them does not send that light.

A scan or a model seldom holds a lamp's bulb. Its pixels then look at the wall behind it, a hundred times brighter than
a reflection is, from each camera at another place. Where other photographs show that place, too, they contradict it;
where none does, all surfaces would receive the light of a lamp at the wall, of any strength. What is as bright in most
other photographs, such as a window or a screen, stands there and shines on, and so does a lamp's reflection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.ndimage
import torch

from rgspipe.capture.exposures import mean_shown
from rgspipe.capture.photographs import SHOWN, Numbers, TracedPhotograph
from rgspipe.datasets.views import View
from rgspipe.fitting.in_sight.lamp import BESIDE, TOUCHING, Mask
from rgspipe.fitting.in_sight.sight import sight_of
from rgspipe.fitting.in_sight.suspects import suspects
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels

#: A pixel is borne out if other photographs show what is there at least so bright, over the pixel's own radiance.
#: Surfels at the rim of a window have a part of its radiance; bulbs have a hundred times that of the wall.
BORNE_OUT = 0.1


def without_bulbs(weights: Sequence[ViewWeights], views: Sequence[View], surfels: Surfels) -> list[View]:
    """Photographs of which pixels that are a lamp's own, before what surfels have there, are not part.

    Args:
        weights: of the views, on the surfels.
        views: under one light; of a single one nobody can tell.
    """
    if len(views) < 2:
        return list(views)
    bright = [_bright(*pair, surfels) for pair in zip(weights, views, strict=True)]
    lamps, more = [np.zeros_like(mask) for mask in bright], any(mask.any() for mask in bright)
    while more:
        # One bulb may bear out another, until that is left out.
        shown, before = _shown(weights, views, lamps), lamps
        lamps = [
            own | (mask & _contradicted(view, weight, np.delete(shown, v, axis=0))) if mask.any() else own
            for v, (view, weight, mask, own) in enumerate(zip(views, weights, bright, before, strict=True))
        ]
        more = any((own != known).any() for own, known in zip(lamps, before, strict=True))
    return [_without(view, lamp) if lamp.any() else view for view, lamp in zip(views, lamps, strict=True)]


def _bright(weight: ViewWeights, view: View, surfels: Surfels) -> Mask:
    """(H, W) pixels that are compact and brighter than reflections, of surfaces that are taken to be all alike."""
    sight = sight_of(weight, replace(surfels, albedo=torch.ones_like(surfels.albedo)), view.alpha)
    found = np.zeros(sight.surface.shape, dtype=bool)
    for lamp in suspects([sight], [_grey(view)], needed=0.0):
        found |= lamp.core
    return found


def _shown(weights: Sequence[ViewWeights], views: Sequence[View], lamps: Sequence[Mask]) -> Numbers:
    """(V, N) grey radiance of each surfel in each photograph beside `lamps`; NaN where it does not show it."""
    means = []
    for weight, view, lamp in zip(weights, views, lamps, strict=True):
        photograph = TracedPhotograph.of(weight, view)
        counted = np.where(lamp.reshape(-1), np.float32(0.0), photograph.base)
        mean, count = mean_shown(photograph, _grey(view).reshape(-1, 1), counted)
        means.append(np.where(count > SHOWN, mean[:, 0], np.nan))
    return np.stack(means)


def _contradicted(view: View, weight: ViewWeights, others: Numbers) -> Mask:
    """(H, W) pixels that the `others` (V − 1, N) do not bear out."""
    known = ~np.isnan(others).all(axis=0)
    elsewhere = np.zeros(others.shape[1])
    elsewhere[known] = np.nanmedian(others[:, known], axis=0)
    grey = _grey(view)
    return (weight.operator.to_scipy() @ elsewhere).reshape(grey.shape) < BORNE_OUT * grey


def _without(view: View, lamp: Mask) -> View:
    """The view without the pixels of a lamp and what is beside them."""
    dark = torch.from_numpy(scipy.ndimage.binary_dilation(lamp, TOUCHING, BESIDE))
    return replace(view, alpha=torch.where(dark, 0.0, view.alpha))


def _grey(view: View) -> Numbers:
    """(H, W) mean radiance of the channels."""
    return view.image.double().mean(dim=2).numpy()
