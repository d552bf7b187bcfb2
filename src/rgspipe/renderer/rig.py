"""Direct light of a rig: points and spots together, with exact derivatives towards everything a fit may move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.spot import SpotShape, angle_slopes, spot_profile
from rgspipe.scene.lights import LightRig, PointLight, SpotLight


@dataclass(frozen=True)
class Rig:
    """L lights as tensors, each of which may require gradients.

    Attributes:
        positions: (L, 3) scene units.
        intensities: (L, 3) W/sr, of a spot on its axis; a fit of log-intensities passes their exponential.
        axes: (L, 3) of the spots, away from the light, of any length but zero; rows of point lights are not read.
            None for a rig without spots.
        shapes: L entries, the spots' profiles, None for a point light. Empty for a rig without spots.

    Raises:
        ValueError: the shapes do not fit together.
    """

    positions: Tensor
    intensities: Tensor
    axes: Tensor | None = None
    shapes: tuple[SpotShape | None, ...] = ()

    def __post_init__(self) -> None:
        expected = (len(self.positions), 3)
        for name in ("positions", "intensities", "axes"):
            tensor = getattr(self, name)
            if tensor is not None and tuple(tensor.shape) != expected:
                raise ValueError(f"a rig's {name} must have shape {expected}, got {tuple(tensor.shape)}")
        if len(self.shapes) not in (0, len(self.positions)) or (any(self.shapes) and self.axes is None):
            raise ValueError("a rig with spots needs a shape (or None) for every light, and axes")

    @classmethod
    def of(cls, lights: LightRig) -> Rig:
        """The rig of `lights`; gradients flow back to their tensors."""
        if not lights:
            return cls(torch.zeros(0, 3), torch.zeros(0, 3))
        positions = torch.stack([light.position for light in lights])
        intensities = torch.stack([light.intensity for light in lights])
        if not any(isinstance(light, SpotLight) for light in lights):
            return cls(positions, intensities)
        no_axis = torch.tensor([0.0, 0.0, 1.0]).to(positions)
        axes = [light.direction.to(positions) if isinstance(light, SpotLight) else no_axis for light in lights]
        shapes = tuple(SpotShape.of(light) if isinstance(light, SpotLight) else None for light in lights)
        return cls(positions, intensities, torch.stack(axes), shapes)

    def lights(self) -> LightRig:
        """The lights, without gradients, with axes of unit length."""
        shapes = self.shapes or (None,) * len(self.positions)
        return tuple(self._light(index, shape) for index, shape in enumerate(shapes))

    def _light(self, index: int, shape: SpotShape | None) -> PointLight | SpotLight:
        position, intensity = self.positions[index].detach(), self.intensities[index].detach()
        if shape is None:
            return PointLight(position, intensity)
        axis = torch.nn.functional.normalize(self.axes[index].detach(), dim=0)
        return SpotLight(position, intensity, axis, shape.profile, shape.cone_angle, shape.falloff)


@dataclass(frozen=True)
class RigResponse:
    """What a rig of unit intensity sends to every surfel, light by light, and how that changes.

    Attributes:
        irradiance: (L, N) float32, per W/sr.
        by_position: (L, N, 3) derivative towards the position, through distance, cosine, shadow and profile.
        by_axis: (L, N, 3) derivative towards the axis, zero for point lights; None for a rig without spots.
    """

    irradiance: Tensor
    by_position: Tensor
    by_axis: Tensor | None


def unit_response(bvh: SurfelBvh, rig: Rig, shadows: bool = True) -> RigResponse:
    """Irradiance of every light at unit intensity, with derivatives: E_l = p(θ_l) · E_point,l.

    Args:
        shadows: whether surfels stand in the light's way.
    """
    irradiance, by_position = unit_irradiance(bvh, rig.positions.detach(), shadows)
    groups = _spots_by_profile(rig.shapes)
    if not groups:
        return RigResponse(irradiance, by_position, None)
    by_axis = torch.zeros_like(by_position)
    for profile, members in groups.items():
        share, share_by_position, share_by_axis = _spot_shares(bvh, rig, profile, members)
        point = irradiance[members]
        irradiance[members] = share * point
        by_position[members] = share[..., None] * by_position[members] + point[..., None] * share_by_position
        by_axis[members] = point[..., None] * share_by_axis
    return RigResponse(irradiance, by_position, by_axis)


def _spots_by_profile(shapes: Sequence[SpotShape | None]) -> dict[str, list[int]]:
    groups: dict[str, list[int]] = {}
    for index, shape in enumerate(shapes):
        if shape is not None:
            groups.setdefault(shape.profile, []).append(index)
    return groups


def _spot_shares(bvh: SurfelBvh, rig: Rig, profile: str, members: list[int]) -> tuple[Tensor, Tensor, Tensor]:
    """Shares (G, N) of the spots `members`, all of one profile, and derivatives (G, N, 3) towards position and axis."""
    centers = bvh.surfels.centers
    # The difference is taken in float64: far from the origin float32 knows neither of the two well enough.
    positions = rig.positions.detach()[members].to(centers.device, torch.float64)
    towards = (centers.double() - positions[:, None]).float()
    axes = torch.nn.functional.normalize(rig.axes.detach()[members].to(towards), dim=1)[:, None]
    shapes = [rig.shapes[index] for index in members]
    cone, falloff = (
        torch.tensor([[getattr(shape, name)] for shape in shapes], dtype=torch.float32, device=towards.device)
        for name in ("cone_angle", "falloff")
    )
    angle, by_towards, by_axis = angle_slopes(axes, towards)
    share, slope = spot_profile(profile, angle, cone, falloff)
    # The angle does not depend on the axis' length, so the derivative towards the axis falls with it.
    length = rig.axes.detach()[members].to(towards).norm(dim=1)[:, None, None]
    return share, -slope[..., None] * by_towards, slope[..., None] * by_axis / length


class _RigIrradiance(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, positions: Tensor, intensities: Tensor, axes: Tensor | None, rig: Rig, bvh: SurfelBvh, shadows: bool
    ) -> Tensor:
        response = unit_response(bvh, rig, shadows)
        strength = intensities.detach().to(response.irradiance)
        ctx.save_for_backward(strength, response.irradiance, response.by_position, response.by_axis)
        ctx.like = [None if x is None else (x.device, x.dtype) for x in (positions, intensities, axes)]
        return response.irradiance.T @ strength

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        strength, irradiance, by_position, by_axis = ctx.saved_tensors
        per_light = strength @ gradient.T
        found = [
            torch.einsum("ln,lnc->lc", per_light, by_position),
            irradiance @ gradient,
            None if by_axis is None else torch.einsum("ln,lnc->lc", per_light, by_axis),
        ]
        moved = [x if x is None else x.to(*like) for x, like in zip(found, ctx.like, strict=True)]
        return (*moved, None, None, None)


def rig_irradiance(bvh: SurfelBvh, rig: Rig, shadows: bool = True) -> Tensor:
    """(N, 3) float32 irradiance of a whole rig, differentiable towards its positions, intensities and axes.

    Derivatives are analytic, through the transmittance and the spots' rims as well; a second derivative is not there.

    Args:
        shadows: whether surfels stand in the light's way.
    """
    return _RigIrradiance.apply(rig.positions, rig.intensities, rig.axes, rig, bvh, shadows)
