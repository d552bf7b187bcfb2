"""Lights that are rotationally symmetric around an axis: intensity times a profile of the angle from it."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from rgspipe.scene.lights.angles import angle_from_axis, angle_slopes
from rgspipe.scene.lights.coordinates import AXIS, PLACE, Coordinate
from rgspipe.scene.lights.light import Light, RelativeIntensity
from rgspipe.scene.lights.point import PointLight
from rgspipe.scene.shapes import Float, Given


@dataclass(frozen=True)
class AxialLight(Light):
    """A light with an axis.

    Attributes:
        direction: (3,) unit vector along the axis, away from the light.
    """

    direction: Given

    @abstractmethod
    def profile_at(self, angle: Tensor, numbers: Mapping[str, Tensor], softness: float = 0.0) -> tuple[Tensor, Tensor]:
        """Part of the axial intensity at `angle` [rad] from the axis, in [0, 1], and its derivative towards the angle.

        Args:
            numbers: the shape's fields by name, which broadcast against `angle`; differentiable by autograd.
            softness: as in `Light.relative_intensity`.
        """

    @abstractmethod
    def kinks(self, softness: float = 0.0) -> list[float]:
        """Angles in [0, π] between which the profile is smooth."""

    @property
    def axis(self) -> Float[Tensor, " 3"]:
        return self.direction

    @property
    def plain(self) -> PointLight:
        return PointLight(self.position, self.intensity)

    def numbers(self, like: Tensor, extent: tuple[int, ...] = ()) -> dict[str, Tensor]:
        """The shape's fields as tensors of dtype and device of `like`."""
        values = {number.name: getattr(self, number.name) for number in self.shape}
        to = {"dtype": like.dtype, "device": like.device}
        return {name: torch.as_tensor(value, **to).expand(extent) for name, value in values.items()}

    def relative_intensity_at(self, angle: Tensor) -> Tensor:
        """Part of the axial intensity at `angle` [rad] from the axis."""
        return self.profile_at(angle, self.numbers(angle))[0]

    def relative_intensity_towards(self, points: Float[Tensor, "N 3"]) -> Float[Tensor, " N"]:
        """(N,) part of the axial intensity that goes towards `points` (N, 3), differentiable by autograd."""
        towards = points - self.position.to(points)
        return self.relative_intensity_at(angle_from_axis(self.direction.to(points), towards))

    def relative_intensity(
        self, points: Float[Tensor, "N 3"], *, softness: float = 0.0, shape_free: bool = False
    ) -> RelativeIntensity:
        # The difference is taken in float64: far from the origin float32 knows neither of the two well enough.
        towards = (points.double() - self.position.detach().to(points.device, torch.float64)).float()
        axis = self.direction.detach().to(towards)
        angle, by_towards, by_axis = angle_slopes(torch.nn.functional.normalize(axis, dim=0)[None], towards)
        # One shape for all points, or one each where every point has a derivative of its own.
        numbers = self.numbers(angle, tuple(angle.shape) if shape_free else ())
        numbers = {name: value.detach().clone().requires_grad_(shape_free) for name, value in numbers.items()}
        with torch.set_grad_enabled(shape_free):
            value, slope = self.profile_at(angle, numbers, softness)
        by_shape = _towards_numbers(value, numbers) if shape_free and numbers else {}
        value, slope = value.detach(), slope.detach()[:, None]
        # The angle does not depend on the axis' length, so the derivative towards the axis falls with it.
        by_axis = slope * by_axis / axis.norm()
        return RelativeIntensity(value, {"position": -slope * by_towards, "direction": by_axis, **by_shape})

    @property
    def least_relative_intensity(self) -> float:
        """No profile rises with the angle, so no relative intensity is smaller than that straight backwards."""
        return float(self.relative_intensity_at(torch.tensor([math.pi], dtype=torch.float64)))

    def power(self) -> Float[Tensor, " 3"]:
        """2π I ∫ p(θ) sin θ dθ."""
        nodes, weights = np.polynomial.legendre.leggauss(64)
        total = 0.0
        for low, high in pairwise(sorted({0.0, *self.kinks(), math.pi})):
            angle = torch.from_numpy(0.5 * (high - low) * nodes + 0.5 * (high + low))
            values = self.relative_intensity_at(angle) * torch.sin(angle)
            total += 0.5 * (high - low) * float((torch.from_numpy(weights) * values).sum())
        return 2.0 * math.pi * total * self.intensity

    def coordinates(self, shape_free: bool = False) -> dict[str, Coordinate]:
        return {"position": PLACE, "direction": AXIS} | super().coordinates(shape_free)


def _towards_numbers(value: Tensor, numbers: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Derivatives (N,) of relative intensities (N,) towards numbers (N,) that they may depend on."""
    if not value.requires_grad:
        return {name: torch.zeros_like(value) for name in numbers}
    slopes = torch.autograd.grad(value.sum(), tuple(numbers.values()), allow_unused=True)
    filled = (torch.zeros_like(value) if slope is None else slope for slope in slopes)
    return dict(zip(numbers, filled, strict=True))
