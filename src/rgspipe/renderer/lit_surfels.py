"""Direct light of one light of unit intensity on surfels, at their centres."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.extent import added
from rgspipe.renderer.kernels.lit_transmittance import lit_transmittance
from rgspipe.renderer.kernels.places import homogeneous
from rgspipe.renderer.kernels.receiver import RECEIVER_FADE, RECEIVER_SKIP
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import surfel_transmittance
from rgspipe.renderer.unit_light import UnitLight, attenuated, emitted_intensity
from rgspipe.scene.lights import Light, RelativeIntensity


@dataclass(frozen=True)
class LitSurfels:
    """What a light of unit intensity sends to N surfels, and how that changes when it moves.

    Attributes:
        origin: (4,) place where shadow rays end.
        passing: (N,) transmittance of the way to each.
        slope: (N, 3) its derivative towards the light's position.
        columns: (N, 1 + D) irradiance per W/sr and its derivatives towards the light's own numbers.
    """

    origin: Tensor
    passing: Tensor
    slope: Tensor
    columns: Tensor


def lit_surfels(bvh: SurfelBvh, light: UnitLight, effects: Effects, least: float | None = None) -> LitSurfels:
    """The surfels under a light: E = p(θ) T max(0, n·d)/|d|³, see `direct.unit_irradiance`.

    Args:
        least: surfels to whose centres the light sends no more than this part p of its intensity are left without
            shadows, which changes nothing there if it is 0; None if they all have theirs, for pixels that look beside
            the centre.
    """
    sent = emitted_intensity(light, bvh.surfels.centers, effects.spots)
    origin = shadow_origin(bvh, light.light)
    passing, slope = _transmittance(bvh, origin, sent, effects.shadows, least)
    factor, factor_slope = (part[0] for part in unit_irradiance(bvh, light.light.place[None], shadows=False))
    moved = factor_slope * passing[:, None] + factor[:, None] * slope
    columns = attenuated(torch.cat([(factor * passing)[:, None], moved], dim=1), sent, light)
    return LitSurfels(origin, passing, slope, columns)


def shadow_origin(bvh: SurfelBvh, light: Light) -> Tensor:
    """(4,) place where shadow rays to a light end: its own, or so far before one that lies on a surface that surfels of
    that surface, which are nowhere quite where it is, are passed, as they are at the other end of the ray.

    That it moves when the light turns is left out of derivatives.
    """
    if not light.flush or not len(bvh.surfels):
        return light.place
    away = float(RECEIVER_SKIP + RECEIVER_FADE) * float(bvh.surfels.scales.detach().median())
    return homogeneous(light.position + away * torch.nn.functional.normalize(light.axis, dim=0))


def lit_columns(
    bvh: SurfelBvh, light: UnitLight, effects: Effects, least: float | None = None, few: bool = False
) -> Tensor:
    """`LitSurfels.columns` (N, 1 + D) of a light that may have an extent, of few points if asked for."""

    def columns(part: UnitLight) -> tuple[Tensor]:
        if part.light.axis is not None:
            return (lit_surfels(bvh, part, effects, least).columns,)
        # A light that shines alike in all directions takes one pass over the surfels.
        irradiance, slope = unit_irradiance(bvh, part.light.place[None], effects.shadows)
        return (attenuated(torch.cat([irradiance.T, slope[0]], dim=1), None, part),)

    return added(light, columns, few)[0]


def _transmittance(
    bvh: SurfelBvh, place: Tensor, sent: RelativeIntensity | None, shadows: bool, least: float | None
) -> tuple[Tensor, Tensor]:
    """`LitSurfels.passing` and `LitSurfels.slope`."""
    if sent is None or least is None or not shadows:
        return surfel_transmittance(bvh, place, shadows)
    return lit_transmittance(bvh, place, sent.value.abs() > least)
