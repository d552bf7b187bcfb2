"""What a fit's covariances and places leave in doubt."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from rgspipe.fitting.findings import Finding, OnSurface, RoughShape, Uncertain, Undetermined
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.scene import Light, LightRig
from rgspipe.scene.surfels import Surfels

#: A point lies over a surfel if it is within so many standard deviations of the middle, in the surfel's plane.
OVER = 2.0


def doubts(
    rig: LightRig,
    covariance: Sequence[Tensor],
    surfels: Surfels,
    scene_size: float,
    options: CertaintyOptions | None = None,
) -> list[Finding]:
    """What the views do not determine, or hardly, and which lights stand on a surface."""
    options = options or CertaintyOptions()
    lights = list(enumerate(zip(rig, covariance, strict=True), start=1))
    undetermined = [_undetermined(light, matrix, number, len(rig)) for number, (light, matrix) in lights]
    rough = [_rough(light, matrix, number, len(rig), options.rough) for number, (light, matrix) in lights]
    uncertain = [_uncertain(*pair, scene_size, number, len(rig), options.doubtful) for number, pair in lights]
    # The covariance of a light that stands on a surface is that of a place that it could not leave.
    limit = options.on_surface * scene_size
    free = [(number, light) for number, (light, _) in lights if not (light.flush or light.distant)]
    standing = [number for number, light in free if distance_to_surface(surfels, light.position) < limit]
    on_surface = [OnSurface(number, len(rig)) for number in standing]
    return [finding for finding in (*undetermined, *rough, *uncertain, *on_surface) if finding is not None]


def _undetermined(light: Light, covariance: Tensor, number: int, count: int) -> Undetermined | None:
    unknown = torch.isinf(covariance.diagonal())
    rows = Emitter.fitted(light, covariance).rows()
    if not bool((light.intensity > 0).any()):
        # Of a light that is off nothing else is known, and it matters to nobody.
        rows.pop("intensity")
    names = tuple(name for name, chosen in rows.items() if bool(unknown[chosen].any()))
    return Undetermined(number, count, names) if names else None


def _rough(light: Light, covariance: Tensor, number: int, count: int, limit: float) -> RoughShape | None:
    emitter, deviations = Emitter.fitted(light, covariance), covariance.diagonal().sqrt()
    rows = {name: rows.start for name, rows in emitter.rows().items() if name in emitter.coordinates}
    shares = {
        name: emitter.coordinates[name].doubt(getattr(light, name), float(deviations[row]))
        for name, row in rows.items()
    }
    told = {name: share for name, share in shares.items() if limit < share < math.inf}
    return RoughShape(number, count, tuple(told), tuple(told.values())) if told else None


def _uncertain(
    light: Light, covariance: Tensor, scene_size: float, number: int, count: int, limit: float
) -> Uncertain | None:
    variance = float(light.standing_spread(covariance, scene_size).diagonal().sum())
    error = math.sqrt(variance) / scene_size if scene_size > 0.0 else 0.0
    return Uncertain(number, count, error, light.distant) if limit < error < math.inf else None


def distance_to_surface(surfels: Surfels, position: Tensor) -> float:
    """From a point (3,) to the plane of the nearest surfel that it lies over, scene units; infinite if over none."""
    normals = surfels.normals.double()
    away = position.to(normals) - surfels.centers.double()
    height = (away * normals).sum(dim=1)
    aside = (away - height[:, None] * normals).norm(dim=1)
    over = aside < OVER * surfels.scales.double().amax(dim=1)
    return float(height[over].abs().min()) if bool(over.any()) else math.inf
