"""The known lights of training views, as irradiance on the surfels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.irradiance import transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene import PointLight

#: Lights whose shadows are traced at once; bounds the memory of their derivatives.
LIGHTS_AT_ONCE = 16

#: Lightings carried through the transport at once.
LIGHTINGS_AT_ONCE = 25


@dataclass(frozen=True)
class Lighting:
    """Direct light of V views on N surfels.

    Attributes:
        irradiance: (V, N) per unit intensity, at the surfels' centres.
        transmittance: (V, N) part of the light that no surfel stops.
        positions: (V, 3) of the lights, float64.
        intensity: (V, 3) W/sr.
    """

    irradiance: Tensor
    transmittance: Tensor
    positions: Tensor
    intensity: Tensor

    def of_views(self, views: Sequence[int]) -> Lighting:
        """The light of some of the views."""
        index = torch.tensor(views, dtype=torch.int64)
        return Lighting(self.irradiance[index], self.transmittance[index], self.positions[index], self.intensity[index])

    def direct(self) -> Tensor:
        """(V, N, 3) direct irradiance over π: the radiance that a white surfel would reflect."""
        return self.irradiance[..., None] * (self.intensity[:, None, :] / math.pi)


def trace_lighting(bvh: SurfelBvh, views: Sequence[View]) -> Lighting:
    """Cast the shadows of every view's light.

    Raises:
        InputError: a view has no light, or one that is no point or does not shine.
    """
    missing = [view.name for view in views if view.light is None]
    if missing:
        found = f"none in {len(missing)} of {len(views)} views ({', '.join(missing[:5])})"
        remedy = "Train on views of a dataset; capture_scene takes photographs under lamps that nobody measured."
        raise InputError("the training views", expected="the light of each", found=found, remedy=remedy)
    others = {view.name: view.light.label for view in views if type(view.light) is not PointLight}
    if others:
        found = f"a {', a '.join(sorted(set(others.values())))}, of {', '.join([*others][:5])}"
        remedy = "Photograph under small bare lamps, or take such photographs as a capture (capture_scene)."
        raise InputError("the training views", expected="point lights", found=found, remedy=remedy)
    dark = [view.name for view in views if not _shines(view.light)]
    if dark:
        expected, found = "lights that shine", f"intensities below 0, or all 0, of {', '.join(dark[:5])}"
        remedy = "Correct them, or leave these photographs out: without light they tell nothing of the surfaces."
        raise InputError("the training views", expected=expected, found=found, remedy=remedy)
    positions = torch.stack([view.light.position for view in views])
    intensity = torch.stack([view.light.intensity for view in views]).float()
    blocks = positions.split(LIGHTS_AT_ONCE)
    passing = torch.cat([transmittance(bvh, block)[0] for block in blocks])
    falloff = torch.cat([unit_irradiance(bvh, block, shadows=False)[0] for block in blocks])
    return Lighting(passing * falloff, passing, positions, intensity.to(bvh.device))


def _shines(light: PointLight) -> bool:
    return bool((light.intensity >= 0.0).all() and (light.intensity > 0.0).any())


def indirect_irradiance(lighting: Lighting, albedo: Tensor, transport: PatchTransport) -> Tensor:
    """(V, N, 3) irradiance over π that surfels of `albedo` (N, 3) receive from each other."""
    indirect = lighting.direct()
    for block in indirect.split(LIGHTINGS_AT_ONCE):
        direct = (albedo * block).permute(1, 2, 0).contiguous()
        block.copy_(transport.gathered(direct).permute(2, 0, 1))
    return indirect


def total_irradiance(lighting: Lighting, albedo: Tensor, transport: PatchTransport | None) -> Tensor:
    """(V, N, 3) direct and, with a transport, indirect irradiance over π under the given albedo (N, 3)."""
    direct = lighting.direct()
    return direct if transport is None else direct + indirect_irradiance(lighting, albedo, transport)
