"""The cone by which formats that know nothing else write a light with an axis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.light_export.parts import is_spot, pose
from rgspipe.percent import percent
from rgspipe.scene.lights import AxialLight

#: Less than this part of a light's power is not spoken of.
LEAST = 0.01

#: Steps of a quarter of a turn.
STEPS = 1800


@dataclass(frozen=True)
class Cone:
    """A beam along a light's axis, or against it where more of the light goes there.

    Attributes:
        inner, outer: half-angles [rad]: a spot's own, or where 90 and 1 % of the peak are left.
        peak: the largest intensity in it, over the light's.
        backwards: whether it shines against the axis.
        lost: share of the light's power that goes beyond 90° from it.
    """

    inner: float
    outer: float
    peak: float = 1.0
    backwards: bool = False
    lost: float = 0.0

    @classmethod
    def of(cls, light: AxialLight) -> Cone:
        """That of a light; a spot's own may be wider than 90°."""
        if is_spot(light, "linear"):
            return cls(float(light.falloff), float(light.cone_angle))
        if is_spot(light, "smoothstep"):
            edge = math.cos(light.cone_angle)
            inner = math.acos(min(1.0, edge + float(light.falloff) * (1.0 - edge)))
            return cls(inner, float(light.cone_angle))
        angles, share, back = _by_angle(light)
        if backwards := back > 0.5:
            share, back = share.flip(0), 1.0 - back
        half, share = angles[: STEPS + 1], share[: STEPS + 1]
        peak = float(share.max())
        # Measured luminaires may be brightest to their sides, or dark below.
        inner, outer = (float(half[share >= level * peak][-1]) for level in (0.9, 0.01))
        return cls(inner, outer, peak, backwards, back)

    def narrow(self, light: AxialLight) -> Cone:
        """The same for formats whose cones end at 90°."""
        if self.outer <= 0.5 * math.pi:
            return self
        outer = 0.5 * math.pi
        return replace(self, inner=min(self.inner, outer), outer=outer, lost=_by_angle(light)[2])

    def pose(self, light: AxialLight) -> Tensor:
        """(4, 4) float64 from the beam's frame, which looks along its −z, to the world."""
        matrix = pose(light)
        if self.backwards:
            matrix[:3, 1:3] *= -1.0
        return matrix

    def notes(self, number: int) -> list[str]:
        """What it does not hold of a light, if that is much."""
        if self.lost < LEAST:
            return []
        return [f"light {number}: {percent(self.lost)} of its light goes beyond 90° from the beam, and is left out."]


def _by_angle(light: AxialLight) -> tuple[Tensor, Tensor, float]:
    """Angles from the axis (A,) [rad], the relative intensity there (A,), and the share of power beyond 90°."""
    angles = torch.linspace(0.0, math.pi, 2 * STEPS + 1, dtype=torch.float64)
    share = light.relative_intensity_at(angles)
    sent = share * angles.sin()
    back, every = (float(torch.trapezoid(sent[first:], angles[first:])) for first in (STEPS, 0))
    return angles, share, back / max(every, 1e-300)
