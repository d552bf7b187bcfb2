"""What a fit may move of one light: position, axis and cone. Intensities are not among it: they have a closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.renderer.spot import SpotShape
from rgspipe.renderer.spot_share import SpotShare
from rgspipe.scene import Light, PointLight, SpotLight

#: A free cone stays between these half-angles, and a free Gaussian falloff within its own limits, rad.
LEAST_CONE, LARGEST_CONE = math.radians(1.0), math.radians(89.0)
LEAST_FALLOFF, LARGEST_FALLOFF = math.radians(0.1), math.radians(60.0)


@dataclass(frozen=True)
class Emitter:
    """A light without its intensity, and how it moves.

    Its parameters, in this order, have about the same effect for the same number: the position in units of the
    scene's size; of a spot two coordinates of the axis, tangent to the sphere at the present axis [rad]; where the
    cone is free, the logit of its half-angle between LEAST_CONE and LARGEST_CONE, and for a Gaussian profile the
    logarithm of its falloff.

    Attributes:
        position: (3,) float64, scene units.
        axis: (3,) float64 of unit length, away from the light; None for a point light.
        shape: the spot's profile; None for a point light.
        cone_free: whether cone and falloff move.
        softness: by how much the rim is widened for now [rad]; see `renderer.spot_share.softened`.
    """

    position: Tensor
    axis: Tensor | None = None
    shape: SpotShape | None = None
    cone_free: bool = False
    softness: float = 0.0

    @classmethod
    def of(cls, light: Light, cone_free: bool = False) -> Emitter:
        """The emitter of a light, on the CPU in float64."""
        position = light.position.double().cpu()
        if isinstance(light, PointLight):
            return cls(position)
        axis = torch.nn.functional.normalize(light.direction.double().cpu(), dim=0)
        return cls(position, axis, SpotShape.of(light), cone_free)

    @property
    def is_spot(self) -> bool:
        return self.shape is not None

    @property
    def parameters(self) -> int:
        """How many parameters it has."""
        if self.shape is None:
            return 3
        return 5 + (self.cone_free + (self.cone_free and self.shape.profile == "gaussian"))

    def light(self, intensity: Tensor) -> Light:
        """The light of `intensity` (3,)."""
        if self.shape is None:
            return PointLight(self.position, intensity)
        shape = self.shape
        return SpotLight(self.position, intensity, self.axis, shape.profile, shape.cone_angle, shape.falloff)

    def units(self, scene_size: float) -> Tensor:
        """(d,) change of the natural parameter (scene units, rad) per unit of each parameter."""
        units = [scene_size] * 3
        if self.shape is not None:
            units += [1.0, 1.0]
        if self.parameters > 5:
            cone = min(max(self.shape.cone_angle, LEAST_CONE), LARGEST_CONE)
            units.append(max((cone - LEAST_CONE) * (LARGEST_CONE - cone) / (LARGEST_CONE - LEAST_CONE), 1e-4))
        if self.parameters > 6:
            units.append(max(self.shape.falloff, LEAST_FALLOFF))
        return torch.tensor(units, dtype=torch.float64)

    def tangents(self) -> Tensor:
        """(2, 3) float64 unit vectors across the axis."""
        helper = torch.zeros(3, dtype=torch.float64)
        helper[int(self.axis.abs().argmin())] = 1.0
        first = torch.nn.functional.normalize(torch.linalg.cross(self.axis, helper), dim=0)
        return torch.stack([first, torch.linalg.cross(self.axis, first)])

    def moved(self, step: Tensor, scene_size: float) -> Emitter:
        """After a step (d,) of the parameters."""
        moved = replace(self, position=self.position + scene_size * step[:3])
        if self.shape is None:
            return moved
        moved = replace(moved, axis=self._turned(step[3:5]))
        return replace(moved, shape=self._reshaped(step[5:])) if self.cone_free else moved

    def _turned(self, turn: Tensor) -> Tensor:
        """The axis after a turn along the sphere (exponential map)."""
        angle = float(turn.norm())
        if angle == 0.0:
            return self.axis
        across = (turn / angle) @ self.tangents()
        return torch.nn.functional.normalize(math.cos(angle) * self.axis + math.sin(angle) * across, dim=0)

    def _reshaped(self, step: Tensor) -> SpotShape:
        shape, span = self.shape, LARGEST_CONE - LEAST_CONE
        share = min(max((shape.cone_angle - LEAST_CONE) / span, 1e-6), 1.0 - 1e-6)
        logit = math.log(share / (1.0 - share)) + float(step[0])
        cone = LEAST_CONE + span / (1.0 + math.exp(-min(max(logit, -30.0), 30.0)))
        falloff = shape.falloff
        if shape.profile == "gaussian":
            falloff = max(falloff, LEAST_FALLOFF) * math.exp(min(max(float(step[1]), -3.0), 3.0))
            falloff = min(max(falloff, LEAST_FALLOFF), LARGEST_FALLOFF)
        elif shape.profile == "linear" and shape.cone_angle > 0.0:
            falloff *= cone / shape.cone_angle
        return SpotShape(shape.profile, cone, falloff)

    def spread(self) -> Tensor:
        """(r, d) natural parameters, with the axis as a vector (x, y, z), per natural tangent parameter."""
        if self.shape is None:
            return torch.eye(3, dtype=torch.float64)
        spread = torch.zeros((self.parameters + 1, self.parameters), dtype=torch.float64)
        spread[:3, :3] = torch.eye(3, dtype=torch.float64)
        spread[3:6, 3:5] = self.tangents().T
        spread[6:, 5:] = torch.eye(self.parameters - 5, dtype=torch.float64)
        return spread


def share_slopes(emitter: Emitter, share: SpotShare) -> Tensor:
    """(N, d) derivatives of a spot's share towards its natural parameters: scene units and rad."""
    across = share.by_axis @ emitter.tangents().T.to(share.by_axis)
    columns = [share.by_position, across]
    if emitter.cone_free:
        by_cone = share.by_cone
        if emitter.shape.profile == "linear" and emitter.shape.cone_angle > 0.0:
            by_cone = by_cone + share.by_falloff * (emitter.shape.falloff / emitter.shape.cone_angle)
        columns.append(by_cone[:, None])
        if emitter.shape.profile == "gaussian":
            columns.append(share.by_falloff[:, None])
    return torch.cat(columns, dim=1)


def shared(columns: Tensor, value: Tensor, slopes: Tensor) -> Tensor:
    """A point light's `columns` (N, …, 4) times the share `value` (N,) with `slopes` (N, d), as (N, …, 1 + d)."""
    between = [1] * (columns.ndim - 2)
    value, slopes = value.reshape(-1, *between, 1), slopes.reshape(len(slopes), *between, -1)
    unit = columns[..., :1]
    products = slopes * unit
    products = torch.cat([products[..., :3] + value * columns[..., 1:], products[..., 3:]], dim=-1)
    return torch.cat([value * unit, products], dim=-1)
