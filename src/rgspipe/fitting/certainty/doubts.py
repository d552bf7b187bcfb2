"""What a fit's covariances and places leave in doubt."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from rgspipe.fitting.findings import Finding, OnSurface, Uncertain, Undetermined
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.scene import Light, LightRig
from rgspipe.scene.surfels import Surfels

#: A position whose error is expected to be larger than this part of the scene's size is said to be in doubt.
IN_DOUBT = 0.05

#: A light nearer to a surface than this part of the scene's size stands on it: 6 mm in a room of 3 m.
ON_SURFACE = 0.002

#: A point lies over a surfel if it is within so many standard deviations of the middle, in the surfel's plane.
OVER = 2.0


def doubts(rig: LightRig, covariance: Sequence[Tensor], surfels: Surfels, scene_size: float) -> list[Finding]:
    """What the views do not determine, or hardly, and which lights stand on a surface."""
    lights = list(enumerate(zip(rig, covariance, strict=True), start=1))
    undetermined = [_undetermined(light, matrix, number, len(rig)) for number, (light, matrix) in lights]
    uncertain = [_uncertain(matrix, scene_size, number, len(rig)) for number, (_, matrix) in lights]
    # The covariance of a light that stands on a surface is that of a place that it could not leave.
    limit = ON_SURFACE * scene_size
    standing = [number for number, (light, _) in lights if distance_to_surface(surfels, light.position) < limit]
    on_surface = [OnSurface(number, len(rig)) for number in standing]
    return [finding for finding in (*undetermined, *uncertain, *on_surface) if finding is not None]


def _undetermined(light: Light, covariance: Tensor, number: int, count: int) -> Undetermined | None:
    unknown = torch.isinf(covariance.diagonal())
    rows = Emitter.fitted(light, covariance).rows()
    if not bool((light.intensity > 0).any()):
        # Of a light that is off nothing else is known, and it matters to nobody.
        rows.pop("intensity")
    names = tuple(name for name, chosen in rows.items() if bool(unknown[chosen].any()))
    return Undetermined(number, count, names) if names else None


def _uncertain(covariance: Tensor, scene_size: float, number: int, count: int) -> Uncertain | None:
    error = math.sqrt(float(covariance.diagonal()[:3].sum())) / scene_size if scene_size > 0.0 else 0.0
    return Uncertain(number, count, error) if IN_DOUBT < error < math.inf else None


def distance_to_surface(surfels: Surfels, position: Tensor) -> float:
    """From a point (3,) to the plane of the nearest surfel that it lies over, scene units; infinite if over none."""
    normals = surfels.normals.double()
    away = position.to(normals) - surfels.centers.double()
    height = (away * normals).sum(dim=1)
    aside = (away - height[:, None] * normals).norm(dim=1)
    over = aside < OVER * surfels.scales.double().amax(dim=1)
    return float(height[over].abs().min()) if bool(over.any()) else math.inf
