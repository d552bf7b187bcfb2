"""Profiles of lights in spherical harmonics, as the published method encodes them, beside the exact profile.

A profile p(θ) is the same all around its axis, so that of all harmonics only the zonal ones are left, which are
Legendre polynomials of the cosine:

    p(θ) ≈ Σ_l c_l P_l(cos θ) ,     c_l = (2l + 1)/2 ∫ p(θ) P_l(cos θ) sin θ dθ ,     l = 0 … L

(Ramamoorthi and Hanrahan 2001). The sum rings around a rim that is sharper than about π/L, and below zero as well; it
is taken as it is. Mirrored, the light goes backwards as it does forwards, p(π − θ) = p(θ), and odd degrees vanish.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from rgspipe.scene.lights import AxialLight, RelativeIntensity
from rgspipe.scene.lights.angles import angle_slopes

#: Nodes of each panel of the quadrature, and further ones for each degree, whose waves they have to follow.
_NODES, _NODES_A_DEGREE = 48, 2


@dataclass(frozen=True)
class BandLimit:
    """How spots are encoded in spherical harmonics.

    Attributes:
        degree: the highest, L.
        mirrored: whether the light also goes backwards, as in the published method.

    Raises:
        ValueError: the degree is negative.
    """

    degree: int = 8
    mirrored: bool = True

    def __post_init__(self) -> None:
        if self.degree < 0:
            raise ValueError(f"a band limit must have a degree of at least 0, got {self.degree}")


def band_limited_intensity(
    light: AxialLight, points: Tensor, band: BandLimit, softness: float = 0.0
) -> RelativeIntensity:
    """`AxialLight.relative_intensity` towards `points` (N, 3) float64 in spherical harmonics, with all derivatives."""
    towards = (points.double() - light.position.to(points.device, torch.float64)).float()
    unit = torch.nn.functional.normalize(light.axis.to(towards), dim=0)[None]
    angle, by_towards, by_axis = angle_slopes(unit, towards)
    coefficients, by_shape = zonal_coefficients(light, band, softness)
    polynomials, rises = legendre(torch.cos(angle), band.degree)
    value, *by_numbers = (polynomials @ torch.stack([coefficients, *by_shape.values()], dim=1).to(angle)).unbind(dim=1)
    slope = -(torch.sin(angle) * (rises @ coefficients.to(angle)))[:, None]
    by = {"position": -slope * by_towards, "direction": slope * by_axis / float(light.axis.norm())}
    return RelativeIntensity(value, by | dict(zip(by_shape, by_numbers, strict=True)))


def zonal_coefficients(light: AxialLight, band: BandLimit, softness: float = 0.0) -> tuple[Tensor, dict[str, Tensor]]:
    """(L + 1,) float64 c_l of a light's profile, and by name their derivatives (L + 1,) towards its shape's numbers.

    By Gauss-Legendre quadrature from one place where the profile is not smooth to the next. A hard edge has no
    derivative.
    """
    angles, weights = _quadrature(light, band, softness)
    numbers = light.numbers(angles, tuple(angles.shape))
    numbers = {name: value.detach().clone().requires_grad_() for name, value in numbers.items()}
    with torch.enable_grad():
        relative, _ = light.profile_at(angles, numbers, softness)
        slopes = torch.autograd.grad(relative.sum(), tuple(numbers.values()), allow_unused=True)
    unmoved = torch.zeros_like(angles)
    columns = torch.stack([relative.detach(), *(unmoved if slope is None else slope for slope in slopes)], dim=1)
    degrees = torch.arange(band.degree + 1, dtype=torch.float64)
    factors = degrees + 0.5
    if band.mirrored:
        factors = torch.where(degrees % 2 == 0, 2.0 * factors, 0.0)
    polynomials, _ = legendre(torch.cos(angles), band.degree)
    projected = factors[:, None] * (polynomials.T @ (columns * (weights * torch.sin(angles))[:, None]))
    return projected[:, 0], dict(zip(numbers, projected[:, 1:].unbind(dim=1), strict=True))


def legendre(z: Tensor, degree: int) -> tuple[Tensor, Tensor]:
    """(N, degree + 1) Legendre polynomials at z (N,) in [−1, 1], and their derivatives towards z.

    By (l + 1) P_{l+1} = (2l + 1) z P_l − l P_{l−1} and P'_{l+1} = P'_{l−1} + (2l + 1) P_l, which need no division by
    1 − z².
    """
    zero, one = torch.zeros_like(z), torch.ones_like(z)
    values, slopes = [one, z], [zero, one]
    for order in range(1, degree):
        values.append(((2 * order + 1) * z * values[order] - order * values[order - 1]) / (order + 1))
        slopes.append(slopes[order - 1] + (2 * order + 1) * values[order])
    return torch.stack(values[: degree + 1], dim=1), torch.stack(slopes[: degree + 1], dim=1)


def _quadrature(light: AxialLight, band: BandLimit, softness: float) -> tuple[Tensor, Tensor]:
    """Angles and weights (Q,) that integrate a profile over the sphere, or over its front half if it is mirrored."""
    end = 0.5 * math.pi if band.mirrored else math.pi
    bounds = sorted({0.0, *(min(place, end) for place in light.kinks(softness)), end})
    nodes, weights = _gauss(_NODES + _NODES_A_DEGREE * band.degree)
    edges = torch.tensor(bounds, dtype=torch.float64)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * edges.diff()
    return (middle[:, None] + half[:, None] * nodes).flatten(), (half[:, None] * weights).flatten()


@lru_cache(maxsize=4)
def _gauss(count: int) -> tuple[Tensor, Tensor]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return torch.from_numpy(nodes), torch.from_numpy(weights)
