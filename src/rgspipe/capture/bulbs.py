"""Lamps whose own pixels photographs show: the surface behind them does not send that light.

A scan or a model seldom holds a lamp's bulb. Its pixels then look at the wall behind it, a hundred times brighter than
a reflection is, from each camera at another place. Where other photographs show that place, too, they contradict it;
where none does, all surfaces would receive the light of a lamp at the wall, of any strength. What is bright in two
photographs in one place, such as a window or a screen, stands there and shines on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from rgspipe.capture.photographs import SHOWN, Numbers
from rgspipe.datasets.views import View
from rgspipe.fitting.in_sight.lamp import LampInSight
from rgspipe.fitting.in_sight.sight import Sight, sight_of
from rgspipe.fitting.in_sight.suspects import suspects
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels

#: A place shines itself if other photographs show at least so much of it as bright.
BORNE_OUT = 0.5


def without_bulbs(weights: Sequence[ViewWeights], views: Sequence[View], surfels: Surfels) -> list[View]:
    """Photographs of which pixels that are a lamp's own, before what surfels have there, are not part.

    Args:
        weights: of the views, on the surfels.
        views: under one light; of a single one nobody can tell.
    """
    if len(views) < 2:
        return list(views)
    plain = replace(surfels, albedo=torch.ones_like(surfels.albedo))
    sights = [sight_of(weight, plain, view.alpha) for weight, view in zip(weights, views, strict=True)]
    lamps = suspects(sights, [_grey(sight, view) for sight, view in zip(sights, views, strict=True)], needed=0.0)
    shown = [_surfels_of(weights[lamp.view], lamp) for lamp in lamps]
    found = list(views)
    for number, lamp in enumerate(lamps):
        elsewhere = [own for own, other in zip(shown, lamps, strict=True) if other.view != lamp.view]
        borne_out = sum(elsewhere, np.zeros(len(surfels))) > SHOWN
        if shown[number] @ borne_out < BORNE_OUT * shown[number].sum():
            alpha = found[lamp.view].alpha
            dark = torch.from_numpy(lamp.pixels).reshape(alpha.shape)
            found[lamp.view] = replace(found[lamp.view], alpha=torch.where(dark, 0.0, alpha))
    return found


def _grey(sight: Sight, view: View) -> Numbers:
    """(H, W) mean radiance of the channels."""
    return view.image.reshape(*sight.surface.shape, 3).double().mean(dim=2).numpy()


def _surfels_of(weight: ViewWeights, lamp: LampInSight) -> Numbers:
    """(N,) pixels of a lamp that look at each surfel."""
    return weight.operator.to_scipy().T @ lamp.core.reshape(-1).astype(np.float64)
