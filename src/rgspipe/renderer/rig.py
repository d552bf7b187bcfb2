"""Direct light of a rig on surfels, with exact derivatives towards the lights' own tensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.lit_surfels import LitSurfels, lit_surfels
from rgspipe.renderer.unit_light import OwnLight
from rgspipe.scene.lights import LightRig


@dataclass(frozen=True)
class RigResponse:
    """What the lights of a rig, each of unit intensity, send to every surfel, and how that changes.

    Attributes:
        lights: L lights.
        irradiance: (L, N) float32, per W/sr.
        slopes: per light (N, D) its derivatives towards the tensors of `OwnLight`, through distance, cosine, shadow and
            profile.
    """

    lights: LightRig
    irradiance: Tensor
    slopes: tuple[Tensor, ...]

    @classmethod
    def of(cls, bvh: SurfelBvh, lights: LightRig, lit: Sequence[LitSurfels]) -> RigResponse:
        """The response to lights of which each is `lit` as an `OwnLight`."""
        rows = [one.columns[:, 0] for one in lit]
        irradiance = torch.stack(rows) if rows else torch.zeros(0, len(bvh.surfels), device=bvh.device)
        return cls(lights, irradiance, tuple(one.columns[:, 1:] for one in lit))

    @property
    def places(self) -> Tensor:
        """(L, 4) of the lights."""
        return stacked(self.lights, "place")

    @property
    def intensities(self) -> Tensor:
        """(L, 3) of the lights, on the device of the irradiance."""
        return stacked(self.lights, "intensity").to(self.irradiance)

    def attached(self) -> Tensor:
        """(L, N) the irradiance, which autograd knows how to differentiate towards the lights' tensors, once."""
        parts = zip(self.lights, self.irradiance, self.slopes, strict=True)
        rows = [OwnLight(light).attached(row, slopes) for light, row, slopes in parts]
        return torch.stack(rows) if rows else self.irradiance

    def summed(self) -> Tensor:
        """(N, 3) irradiance of the whole rig, differentiable like `attached`."""
        return self.attached().T @ self.intensities


def unit_response(bvh: SurfelBvh, rig: LightRig, effects: Effects = ALL_EFFECTS) -> RigResponse:
    """Irradiance of every light at unit intensity, with derivatives."""
    lights = effects.lights(tuple(rig))
    return RigResponse.of(bvh, lights, [lit_surfels(bvh, OwnLight(light), effects, 0.0) for light in lights])


def rig_irradiance(bvh: SurfelBvh, rig: LightRig, effects: Effects = ALL_EFFECTS) -> Tensor:
    """(N, 3) float32 irradiance of a whole rig, differentiable towards the tensors of its lights.

    Derivatives are analytic, through the transmittance and the spots' rims as well.
    """
    return unit_response(bvh, rig, effects).summed()


def stacked(lights: LightRig, field: str) -> Tensor:
    """(L, …) a field of all lights; gradients flow back to their tensors."""
    return torch.stack([getattr(light, field) for light in lights]) if lights else torch.zeros(0, 3)
