"""Direct light of a rig on surfels, with exact derivatives towards the lights' own tensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.lights import Light, LightRig, Share


@dataclass(frozen=True)
class RigResponse:
    """What the lights of a rig, each of unit intensity, send to every surfel, and how that changes.

    Attributes:
        lights: L lights.
        irradiance: (L, N) float32, per W/sr.
        slopes: per light its derivatives by field: (N, 3) towards the position, through distance, cosine, shadow and
            profile, and towards the axis; (N,) towards numbers of the shape that require gradients.
    """

    lights: LightRig
    irradiance: Tensor
    slopes: tuple[Mapping[str, Tensor], ...]

    @property
    def positions(self) -> Tensor:
        """(L, 3) of the lights."""
        return stacked(self.lights, "position")

    @property
    def intensities(self) -> Tensor:
        """(L, 3) of the lights, on the device of the irradiance."""
        return stacked(self.lights, "intensity").to(self.irradiance)

    def attached(self) -> Tensor:
        """(L, N) the irradiance, which autograd knows how to differentiate towards the lights' tensors.

        What is added is zero, and its derivative is the response's: exact to first order. A second derivative is not
        there.
        """
        rows = []
        for row, light, slopes in zip(self.irradiance, self.lights, self.slopes, strict=True):
            for name, slope in slopes.items():
                value = getattr(light, name)
                if isinstance(value, Tensor) and value.requires_grad:
                    change = (value - value.detach()).to(slope)
                    row = row + (slope @ change if change.ndim else slope * change)
            rows.append(row)
        return torch.stack(rows) if rows else self.irradiance


def unit_response(bvh: SurfelBvh, lights: LightRig, shadows: bool = True) -> RigResponse:
    """Irradiance of every light at unit intensity, with derivatives: E_l = p(θ_l) · E_point,l.

    Args:
        shadows: whether surfels stand in the lights' way.
    """
    irradiance, by_position = unit_irradiance(bvh, stacked(lights, "position").detach(), shadows)
    rows = [
        _with_share(light.share(bvh.surfels.centers, shape_free=_shape_moves(light)), *of_point)
        for light, *of_point in zip(lights, irradiance, by_position, strict=True)
    ]
    irradiance = torch.stack([row for row, _ in rows]) if rows else irradiance
    return RigResponse(tuple(lights), irradiance, tuple(slopes for _, slopes in rows))


def _with_share(share: Share | None, row: Tensor, by_position: Tensor) -> tuple[Tensor, dict[str, Tensor]]:
    """A point light's irradiance (N,) and derivative (N, 3) times the share of the light that goes there."""
    if share is None:
        return row, {"position": by_position}
    slopes = {name: (row[:, None] if by.ndim > 1 else row) * by for name, by in share.by.items()}
    slopes["position"] = share.value[:, None] * by_position + slopes["position"]
    return share.value * row, slopes


def _shape_moves(light: Light) -> bool:
    """Whether gradients towards a number of the light's shape are wanted."""
    values = (getattr(light, number.name) for number in light.shape)
    return any(isinstance(value, Tensor) and value.requires_grad for value in values)


def rig_irradiance(bvh: SurfelBvh, lights: LightRig, shadows: bool = True) -> Tensor:
    """(N, 3) float32 irradiance of a whole rig, differentiable towards the tensors of its lights.

    Derivatives are analytic, through the transmittance and the spots' rims as well.

    Args:
        shadows: whether surfels stand in the lights' way.
    """
    response = unit_response(bvh, lights, shadows)
    return response.attached().T @ response.intensities


def stacked(lights: LightRig, field: str) -> Tensor:
    """(L, 3) a field of all lights; gradients flow back to their tensors."""
    return torch.stack([getattr(light, field) for light in lights]) if lights else torch.zeros(0, 3)
