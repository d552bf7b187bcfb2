"""What a view's pixels look at, as far as it says how bright a reflection there can be."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from rgspipe.fitting.model.views import LEAST_SHARE, PreparedViews
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, Surfels

Numbers = npt.NDArray[np.float64]

#: Albedo below this counts as this: what is nearly black reflects errors of the model.
DARKEST = 0.05


@dataclass(frozen=True, eq=False)
class Sight:
    """One view.

    Attributes:
        camera: whose view it is.
        surface: (H, W) bool, pixels that look at a surface of the scene and at nothing else.
        albedo: (H, W) mean of its channels there, no less than DARKEST.
        distance: (H, W) from the camera to it, scene units.
        angle: (H, W) solid angle of each pixel [sr].
    """

    camera: Camera
    surface: npt.NDArray[np.bool_]
    albedo: Numbers
    distance: Numbers
    angle: Numbers


def sights(views: PreparedViews) -> tuple[Sight, ...]:
    """Of each view."""
    pairs = zip(views.views, views.masks, strict=True)
    surfels = replace(views.frozen.bvh.surfels, albedo=views.frozen.surfels.albedo)
    return tuple(sight_of(view, surfels, mask) for view, mask in pairs)


def sight_of(view: ViewWeights, surfels: Surfels, mask: Tensor) -> Sight:
    """Of one view of surfels, where its `mask` (H·W values) has the scene in sight."""
    size = (view.camera.height, view.camera.width)
    # From the camera, as float32 keeps no digits of what is far from the origin.
    away = (surfels.centers - view.camera.origin.to(surfels.centers.device)).float()
    values = torch.cat([surfels.albedo.float().mean(dim=1, keepdim=True), away], dim=1)
    coverage = view.coverage.double().cpu()
    seen = (view.operator @ values).double().cpu() / coverage.clamp(min=LEAST_SHARE)[:, None]
    surface = (coverage > LEAST_SHARE) & (mask.reshape(-1).double().cpu() >= LEAST_SHARE)
    distance = seen[:, 1:].norm(dim=1)
    stacked = (surface, seen[:, 0].clamp(min=DARKEST), distance, pixel_angles(view.camera))
    return Sight(view.camera, *(part.reshape(size).numpy() for part in stacked))


def pixel_angles(camera: Camera) -> torch.Tensor:
    """(H·W,) float64 solid angle of each pixel [sr]."""
    _, _, lengths = camera.rays()
    return 1.0 / (camera.fx * camera.fy * lengths**3)


def needed_intensity(views: PreparedViews, shading: float) -> float:
    """About the intensity [W/sr] of lights that make the scene as bright as it is, however they stand.

    What lamps send, 4πI, its surfaces take in: πS (1 − ρ) of each area, S the radiance over the albedo.

    Args:
        shading: the mean of S, W/sr/m² or whatever the images hold.
    """
    frozen = views.frozen
    absorbed = frozen.areas.double().cpu() * (1.0 - frozen.surfels.albedo.double().cpu().mean(dim=1))
    return math.pi * shading * float(absorbed.sum()) / (4.0 * math.pi)
