"""Real spherical harmonics as polynomials of the direction, so that their derivatives are finite everywhere.

With associated Legendre functions divided by sinᵐθ, which leaves polynomials Q of z = cos θ:

    Y_l,m = √2 · Q_l^m(z) · Re (x + iy)^m       m > 0
    Y_l,0 = Q_l^0(z)
    Y_l,m = √2 · Q_l^|m|(z) · Im (x + iy)^|m|   m < 0

Orthonormal on the sphere, without the Condon-Shortley sign; coefficient l(l + 1) + m of (L + 1)². No angle is taken,
so the poles are points like others (Sloan 2013, "Efficient spherical harmonic evaluation").
"""

from __future__ import annotations

import math

import torch
from torch import Tensor


def coefficient_count(degree: int) -> int:
    """Number of harmonics up to `degree`, (degree + 1)²."""
    return (degree + 1) ** 2


def real_harmonics(directions: Tensor, degree: int) -> Tensor:
    """(…, (degree + 1)²) harmonics of unit vectors (…, 3), differentiable towards them."""
    x, y, z = directions.unbind(-1)
    values: dict[tuple[int, int], Tensor] = {}
    cosine, sine = torch.ones_like(x), torch.zeros_like(x)
    for m in range(degree + 1):
        for order, legendre in enumerate(_legendre_over_sine(z, m, degree), start=m):
            if m == 0:
                values[order, 0] = legendre
            else:
                values[order, m], values[order, -m] = (math.sqrt(2.0) * legendre * part for part in (cosine, sine))
        cosine, sine = x * cosine - y * sine, x * sine + y * cosine
    return torch.stack([values[order, m] for order in range(degree + 1) for m in range(-order, order + 1)], dim=-1)


def _legendre_over_sine(z: Tensor, m: int, degree: int) -> list[Tensor]:
    """Orthonormal associated Legendre functions over sinᵐθ, of degrees m … `degree`."""
    first = math.sqrt(math.prod((2 * k + 1) / (2 * k) for k in range(1, m + 1)) / (4.0 * math.pi))
    functions = [torch.full_like(z, first)]
    for order in range(m + 1, degree + 1):
        gain = math.sqrt((4.0 * order**2 - 1.0) / (order**2 - m**2))
        value = z * functions[-1]
        if order > m + 1:
            before = order - 1
            value = value - math.sqrt((before**2 - m**2) / (4.0 * before**2 - 1.0)) * functions[-2]
        functions.append(gain * value)
    return functions


def per_harmonic(zonal: Tensor) -> Tensor:
    """(…, (L + 1)²) the value (…, L + 1) of each degree, repeated for its 2l + 1 harmonics."""
    degrees = torch.arange(zonal.shape[-1], device=zonal.device)
    return zonal[..., torch.repeat_interleave(degrees, 2 * degrees + 1)]
