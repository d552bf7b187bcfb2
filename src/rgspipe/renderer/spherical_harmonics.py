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
    legendre, powers = _parts(directions, degree)
    return torch.stack([_harmonic(legendre[order, abs(m)], powers, m) for order, m in _indices(degree)], dim=-1)


def real_harmonics_and_slopes(directions: Tensor, degree: int) -> tuple[Tensor, Tensor]:
    """`real_harmonics` and their derivatives (…, (degree + 1)², 3) towards the vectors' components.

    By dQ_l^m/dz = √((l − m)(l + m + 1)) Q_l^{m+1} and d(x + iy)ᵐ = m (x + iy)ᵐ⁻¹ (dx + i dy).
    """
    legendre, powers = _parts(directions, degree)
    zero = torch.zeros_like(directions[..., 0])
    values, slopes = [], []
    for order, signed in _indices(degree):
        m, function = abs(signed), legendre[order, abs(signed)]
        values.append(_harmonic(function, powers, signed))
        gain = math.sqrt((order - m) * (order + m + 1))
        upwards = _harmonic(gain * legendre[order, m + 1], powers, signed) if order > m else zero
        along_x, along_y = zero, zero
        if m > 0:
            cosine, sine = (math.sqrt(2.0) * m * function * part for part in powers[m - 1])
            along_x, along_y = (cosine, -sine) if signed > 0 else (sine, cosine)
        slopes.append(torch.stack([along_x, along_y, upwards], dim=-1))
    return torch.stack(values, dim=-1), torch.stack(slopes, dim=-2)


def _indices(degree: int) -> list[tuple[int, int]]:
    """(l, m) in the order of the coefficients."""
    return [(order, m) for order in range(degree + 1) for m in range(-order, order + 1)]


def _parts(directions: Tensor, degree: int) -> tuple[dict[tuple[int, int], Tensor], list[tuple[Tensor, Tensor]]]:
    """Q_l^m by (l, m) for m ≥ 0, and real and imaginary part of (x + iy)ᵐ for m = 0 … `degree`."""
    x, y, z = directions.unbind(-1)
    powers = [(torch.ones_like(x), torch.zeros_like(x))]
    for _ in range(degree):
        cosine, sine = powers[-1]
        powers.append((x * cosine - y * sine, x * sine + y * cosine))
    columns = {m: _legendre_over_sine(z, m, degree) for m in range(degree + 1)}
    return {(m + k, m): function for m, column in columns.items() for k, function in enumerate(column)}, powers


def _harmonic(legendre: Tensor, powers: list[tuple[Tensor, Tensor]], m: int) -> Tensor:
    if m == 0:
        return legendre
    return math.sqrt(2.0) * legendre * powers[abs(m)][0 if m > 0 else 1]


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
