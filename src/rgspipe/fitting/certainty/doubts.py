"""What a fit's covariances and places leave in doubt, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.scene import LightRig
from rgspipe.scene.surfels import Surfels

#: A position whose error is expected to be larger than this part of the scene's size is said to be in doubt.
IN_DOUBT = 0.05

#: A light nearer to a surface than this part of the scene's size stands on it: 6 mm in a room of 3 m.
ON_SURFACE = 0.002

#: A point lies over a surfel if it is within so many standard deviations of the middle, in the surfel's plane.
OVER = 2.0

#: What people call a light's fields.
NAMES = {"direction": "axis"}


def doubts(rig: LightRig, covariance: Sequence[Tensor], surfels: Surfels, scene_size: float) -> str:
    """What the views do not determine, or hardly, in a sentence or two; empty if nothing is in doubt."""
    said = _undetermined(rig, covariance), _uncertain(covariance, scene_size), _stopped(rig, surfels, scene_size)
    return " ".join(filter(None, said))


def _uncertain(covariance: Sequence[Tensor], scene_size: float) -> str:
    """The positions that may be far off, with by how much."""
    variances = [float(matrix.diagonal()[:3].sum()) for matrix in covariance]
    errors = [math.sqrt(variance) / scene_size if scene_size > 0.0 else 0.0 for variance in variances]
    parts = [
        (f"light {index + 1}" if len(errors) > 1 else "the position") + f" by {100.0 * error:.0f} %"
        for index, error in enumerate(errors)
        if IN_DOUBT < error < math.inf
    ]
    if not parts:
        return ""
    return f"Uncertain, in parts of the scene's size: {', '.join(parts)}; give more views, or a sharper scene."


def _undetermined(rig: LightRig, covariance: Sequence[Tensor]) -> str:
    """What the views do not determine, as a sentence; empty if everything is."""
    parts = []
    for index, (light, matrix) in enumerate(zip(rig, covariance, strict=True)):
        unknown = torch.isinf(matrix.diagonal())
        dark = not bool((light.intensity > 0).any())
        rows = Emitter.fitted(light, matrix).rows()
        names = [
            NAMES.get(name, name.replace("_", " "))
            for name, chosen in rows.items()
            if bool(unknown[chosen].any()) and not (name == "intensity" and dark)
        ]
        if names:
            parts.append(" and ".join(names) + (f" of light {index + 1}" if len(rig) > 1 else ""))
    return f"Not determined by these views: {'; '.join(parts)}." if parts else ""


def _stopped(rig: LightRig, surfels: Surfels, scene_size: float) -> str:
    """Which lights stand on a surface, as a sentence: their covariance is that of a place that they could not leave."""
    limit = ON_SURFACE * scene_size
    standing = [index for index, light in enumerate(rig) if distance_to_surface(surfels, light.position) < limit]
    if not standing:
        return ""
    if len(rig) == 1:
        which = "The light stands"
    else:
        numbers = " and ".join(str(index + 1) for index in standing)
        which = f"Light {numbers} stands" if len(standing) == 1 else f"Lights {numbers} stand"
    return f"{which} on a surface, where lights that belong elsewhere are stopped: give more views."


def distance_to_surface(surfels: Surfels, position: Tensor) -> float:
    """From a point (3,) to the plane of the nearest surfel that it lies over, scene units; infinite if over none."""
    normals = surfels.normals.double()
    away = position.to(normals) - surfels.centers.double()
    height = (away * normals).sum(dim=1)
    aside = (away - height[:, None] * normals).norm(dim=1)
    over = aside < OVER * surfels.scales.double().amax(dim=1)
    return float(height[over].abs().min()) if bool(over.any()) else math.inf
