"""Spots in spherical harmonics, as the published method encodes them, beside the exact profile.

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

from rgspipe.renderer.spot import SpotShape, angle_slopes, spot_profile
from rgspipe.renderer.spot_share import SpotShare, softened, spot_share_slopes

#: Nodes of each panel of the quadrature, and further ones for each degree, whose waves they have to follow.
_NODES, _NODES_A_DEGREE = 48, 2

#: A Gaussian rim is integrated in steps of so many standard deviations, up to where it is zero in every precision.
_STEPS = (0.0, 3.0, 6.0, 9.0)


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


def fitted_share(
    points: Tensor,
    position: Tensor,
    axis: Tensor,
    shape: SpotShape,
    softness: float,
    band: BandLimit | None,
    cone_free: bool = True,
) -> SpotShare:
    """What a fit takes for the share of a spot's light towards `points`: exact, or band-limited.

    Args:
        points: (N, 3) float64.
        position, axis: (3,) of the spot.
        shape: its profile.
        softness: widens the rim by so much [rad]; see `renderer.spot_share.softened`.
        band: None for the exact profile.
        cone_free: whether the exact profile's derivatives towards cone angle and falloff are wanted.
    """
    if band is None:
        return spot_share_slopes(points, position, axis, shape, softness, cone_free)
    towards = (points.double() - position.to(points.device, torch.float64)).float()
    unit = torch.nn.functional.normalize(axis.to(towards), dim=0)[None]
    angle, by_towards, by_axis = angle_slopes(unit, towards)
    coefficients = zonal_coefficients(shape, band, softness).to(angle)
    polynomials, rises = legendre(torch.cos(angle), band.degree)
    value, by_cone, by_falloff = (polynomials @ coefficients).unbind(dim=1)
    slope = -(torch.sin(angle) * (rises @ coefficients[:, 0]))[:, None]
    return SpotShare(value, -slope * by_towards, slope * by_axis, by_cone, by_falloff)


def zonal_coefficients(shape: SpotShape, band: BandLimit, softness: float = 0.0) -> Tensor:
    """(L + 1, 3) float64 c_l of a profile, and their derivatives towards its cone angle and its falloff.

    By Gauss-Legendre quadrature from one place where the profile is not smooth to the next. A hard edge has no
    derivative.
    """
    angles, weights = _quadrature(shape, band, softness)
    cone, falloff = (torch.full_like(angles, x).requires_grad_() for x in (shape.cone_angle, shape.falloff))
    with torch.enable_grad():
        profile, *rim = softened(shape.profile, cone, falloff, softness)
        share, _ = spot_profile(profile, angles, *rim)
        slopes = torch.autograd.grad(share.sum(), (cone, falloff), allow_unused=True)
    unmoved = torch.zeros_like(angles)
    columns = torch.stack([share.detach(), *(unmoved if slope is None else slope for slope in slopes)], dim=1)
    degrees = torch.arange(band.degree + 1, dtype=torch.float64)
    factors = degrees + 0.5
    if band.mirrored:
        factors = torch.where(degrees % 2 == 0, 2.0 * factors, 0.0)
    polynomials, _ = legendre(torch.cos(angles), band.degree)
    return factors[:, None] * (polynomials.T @ (columns * (weights * torch.sin(angles))[:, None]))


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


def _quadrature(shape: SpotShape, band: BandLimit, softness: float) -> tuple[Tensor, Tensor]:
    """Angles and weights (Q,) that integrate a profile over the sphere, or over its front half if it is mirrored."""
    end = 0.5 * math.pi if band.mirrored else math.pi
    bounds = sorted({0.0, *(min(max(place, 0.0), end) for place in _rim_places(shape, softness)), end})
    nodes, weights = _gauss(_NODES + _NODES_A_DEGREE * band.degree)
    edges = torch.tensor(bounds, dtype=torch.float64)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * edges.diff()
    return (middle[:, None] + half[:, None] * nodes).flatten(), (half[:, None] * weights).flatten()


@lru_cache(maxsize=4)
def _gauss(count: int) -> tuple[Tensor, Tensor]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return torch.from_numpy(nodes), torch.from_numpy(weights)


def _rim_places(shape: SpotShape, softness: float) -> list[float]:
    """Angles between which a profile is smooth."""
    cone, falloff = (torch.tensor(x, dtype=torch.float64) for x in (shape.cone_angle, shape.falloff))
    profile, *rim = softened(shape.profile, cone, falloff, softness)
    cone, falloff = map(float, rim)
    if profile == "gaussian":
        return [cone + step * falloff for step in _STEPS]
    if profile == "linear":
        return [falloff, cone]
    edge = math.cos(cone)
    return [math.acos(max(-1.0, min(1.0, edge + falloff * (1.0 - edge)))), cone]
