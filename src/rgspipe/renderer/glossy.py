"""The Phong lobe: its value, its expansion in Legendre polynomials, and how large it can be.

Modified Phong model, normalised by its energy (Lafortune and Willems 1994, "Using the modified Phong reflectance model
for physically based rendering"):

    f(ω_i, ω_o) = ρ/π + k_s · p_n(cos α) ,     p_n(x) = (n + 2)/(2π) · max(0, x)^n

α is the angle between ω_o and the mirrored ω_i, which is the angle between ω_i and the mirrored ω_o.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.scene.gloss import Gloss

#: A vector shorter than this many scales of its surfel has no direction of its own any more.
DIRECTION_SOFTENING = 1e-3


def phong_lobe(cosines: Tensor, exponents: Tensor) -> Tensor:
    """p_n(cos α), 1/sr, for cosines and exponents n ≥ 1 that broadcast; its integral over cos α · dω is 1."""
    return (exponents + 2.0) / (2.0 * math.pi) * cosines.clamp(min=0.0).pow(exponents)


def phong_slope(cosines: Tensor, exponents: Tensor) -> Tensor:
    """p_n'(cos α), the derivative of `phong_lobe` towards the cosine."""
    return exponents * (exponents + 2.0) / (2.0 * math.pi) * cosines.clamp(min=0.0).pow(exponents - 1.0)


def lobe_coefficients(exponents: Tensor, degree: int) -> Tensor:
    """(N, degree + 1) Legendre coefficients λ_l = 2π ∫ p_n(x) P_l(x) dx of the lobes, in closed form.

        λ_0 = (n + 2)/(n + 1) ,   λ_1 = 1 ,   λ_l = λ_{l−2} · (n − l + 2)/(n + l + 1)

    So that p_n(ω·r) = Σ_l λ_l Σ_m Y_lm(ω) Y_lm(r), by the addition theorem.
    """
    coefficients = [(exponents + 2.0) / (exponents + 1.0), torch.ones_like(exponents)]
    for order in range(2, degree + 1):
        coefficients.append(coefficients[order - 2] * (exponents - order + 2.0) / (exponents + order + 1.0))
    return torch.stack(coefficients[: degree + 1], dim=-1)


def mirrored(vectors: Tensor, normals: Tensor) -> Tensor:
    """Vectors (…, 3), mirrored at unit normals (…, 3): 2 (n·v) n − v. Its own inverse and its own transpose."""
    return 2.0 * (vectors * normals).sum(-1, keepdim=True) * normals - vectors


def soft_directions(vectors: Tensor, scales: Tensor) -> Tensor:
    """Directions of vectors (…, 3) whose derivative stays finite at zero length.

    They are shorter than 1 by ½ (DIRECTION_SOFTENING · scale/|v|)²: 5e-7 at one scale of the surfel.

    Args:
        scales: (…,) of the surfels, scene units.
    """
    return vectors * _inverse_length(vectors, scales)


def soft_directions_and_slopes(vectors: Tensor, scales: Tensor) -> tuple[Tensor, Tensor]:
    """`soft_directions` and their derivative (…, 3, 3) towards the vectors, symmetric."""
    inverse = _inverse_length(vectors, scales)
    directions = vectors * inverse
    outer = directions[..., :, None] * directions[..., None, :]
    return directions, (torch.eye(3).to(vectors) - outer) * inverse[..., None]


def _inverse_length(vectors: Tensor, scales: Tensor) -> Tensor:
    shortest = (DIRECTION_SOFTENING * scales).square()
    return (vectors.square().sum(-1) + shortest).rsqrt()[..., None]


def largest_lobe(gloss: Gloss) -> Tensor:
    """(N,) peak of each surfel's lobe as a ratio to a white diffuse surface, max k_s · (n + 2)/2.

    Irradiance E makes a specular radiance of at most `largest_lobe · E/π` in any direction, where the diffuse part is
    ρ E/π. 0 for a diffuse surfel.
    """
    return gloss.reflectance.amax(dim=1) * (gloss.exponents + 2.0) / 2.0
