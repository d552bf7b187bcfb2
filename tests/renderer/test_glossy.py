"""The Phong lobe: its energy, its expansion, and derivatives that stay finite."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import scipy.special
import torch
from torch import Tensor

from rgspipe.renderer.glossy import largest_lobe, lobe_coefficients, mirrored, phong_lobe, soft_directions
from rgspipe.renderer.spherical_harmonics import per_harmonic, real_harmonics
from rgspipe.scene import Gloss

EXPONENTS = (1.0, 2.5, 10.0, 50.0, 300.0)


def quadrature(nodes: int = 400) -> tuple[Tensor, Tensor]:
    """Nodes and weights on [0, 1], where the lobe is smooth."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return torch.from_numpy(0.5 * (x + 1.0)), torch.from_numpy(0.5 * w)


def directions(count: int, seed: int = 0) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.nn.functional.normalize(torch.randn(count, 3, generator=generator, dtype=torch.float64), dim=1)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_lobe_coefficients_are_the_integrals_of_the_lobe(exponent: float) -> None:
    x, w = quadrature()
    n = torch.tensor(exponent, dtype=torch.float64)
    lobe = phong_lobe(x, n)
    polynomials = [torch.from_numpy(scipy.special.eval_legendre(order, x.numpy())) for order in range(13)]
    expected = [2.0 * math.pi * (w * lobe * polynomial).sum() for polynomial in polynomials]
    # Measured 3e-12.
    torch.testing.assert_close(lobe_coefficients(n, 12), torch.stack(expected), rtol=0, atol=1e-10)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_light_along_the_normal_is_reflected_whole_and_slanted_light_never_more(exponent: float) -> None:
    """∫ p_n(cos α) cos θ dω over the hemisphere is 1 for light along the normal, and falls with its angle."""
    z, w = quadrature(300)
    angle = 2.0 * math.pi * (torch.arange(256).double() + 0.5) / 256
    ring = (1.0 - z * z).sqrt()[:, None]
    out = torch.stack([ring * angle.cos(), ring * angle.sin(), z[:, None].expand(-1, 256)], dim=-1)
    shares = []
    for slant in (0.0, 0.4, 0.8, 1.2, 1.5):
        mirror = torch.tensor([math.sin(slant), 0.0, math.cos(slant)], dtype=torch.float64)
        lobe = phong_lobe(out @ mirror, torch.tensor(exponent, dtype=torch.float64))
        shares.append(float((lobe.mean(dim=1) * 2.0 * math.pi * z * w).sum()))
    # Measured 1 − 5e-13.
    assert shares[0] == pytest.approx(1.0, rel=1e-10)
    assert all(before > after for before, after in pairwise(shares))


def test_the_lobe_is_reciprocal() -> None:
    """f(ω_i, ω_o) = f(ω_o, ω_i): mirroring either direction gives the same angle."""
    normal, one, other = directions(100), directions(100, 1), directions(100, 2)
    there = (mirrored(one, normal) * other).sum(-1)
    back = (mirrored(other, normal) * one).sum(-1)
    torch.testing.assert_close(there, back, rtol=0, atol=1e-14)
    torch.testing.assert_close(mirrored(mirrored(one, normal), normal), one, rtol=0, atol=1e-14)


def test_convolution_by_coefficients_is_the_integral_over_the_sphere() -> None:
    """Funk and Hecke: ∫ p(ω·ω') Y_k(ω') dω' = λ_l Y_k(ω)."""
    z, w = np.polynomial.legendre.leggauss(60)
    angle = 2.0 * np.pi * np.arange(120) / 120
    ring = np.sqrt(1.0 - z**2)[:, None]
    points = np.stack([ring * np.cos(angle), ring * np.sin(angle), np.broadcast_to(z[:, None], (60, 120))])
    points, weights = torch.from_numpy(points.reshape(3, -1).T.copy()), torch.from_numpy(np.repeat(w * np.pi / 60, 120))
    exponent, at = torch.tensor(9.0, dtype=torch.float64), directions(20)
    integral = torch.einsum("q,pq,qk->pk", weights, phong_lobe(at @ points.T, exponent), real_harmonics(points, 6))
    expected = per_harmonic(lobe_coefficients(exponent, 6)) * real_harmonics(at, 6)
    # Measured 5e-14.
    torch.testing.assert_close(integral, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("exponent", "errors"),
    # L2 error of the truncated lobe over its norm, for degrees 2, 4, 6 and 8.
    [
        (2.0, (0.177, 0.029, 0.011, 0.006)),
        (10.0, (0.662, 0.309, 0.091, 0.014)),
        (20.0, (0.807, 0.549, 0.305, 0.137)),
        (100.0, (0.956, 0.884, 0.784, 0.669)),
    ],
)
def test_truncated_lobes_converge_to_the_exact_one_as_documented(exponent: float, errors: tuple[float, ...]) -> None:
    x = torch.cat([-quadrature()[0], quadrature()[0]])
    w = quadrature()[1].repeat(2)
    n = torch.tensor(exponent, dtype=torch.float64)
    exact = phong_lobe(x, n)
    for degree, expected in zip((2, 4, 6, 8), errors, strict=True):
        terms = zip(range(degree + 1), lobe_coefficients(n, degree), strict=True)
        legendre = scipy.special.eval_legendre
        series = sum((2 * k + 1) / (4.0 * math.pi) * c * torch.from_numpy(legendre(k, x.numpy())) for k, c in terms)
        found = (((series - exact).square() * w).sum() / (exact.square() * w).sum()).sqrt()
        assert float(found) == pytest.approx(expected, abs=1e-3)


def test_derivatives_of_the_lobe_are_finite_where_it_begins_and_right_elsewhere() -> None:
    cosines = torch.tensor([-1.0, -0.3, 0.0, 0.2, 1.0], requires_grad=True)
    exponents = torch.tensor([[1.0], [7.0], [200.0]], requires_grad=True)
    phong_lobe(cosines, exponents).sum().backward()
    assert torch.isfinite(cosines.grad).all()
    assert torch.isfinite(exponents.grad).all()
    inner = torch.tensor([0.1, 0.5, 0.9], dtype=torch.float64, requires_grad=True)
    n = torch.tensor(7.0, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(phong_lobe, (inner, n))
    assert torch.autograd.gradcheck(lambda n: lobe_coefficients(n[None], 8), (n,))


def test_a_direction_at_zero_length_is_zero_and_has_a_slope() -> None:
    vectors = torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.0, 0.02]], requires_grad=True)
    found = soft_directions(vectors, torch.tensor([0.02, 0.02]))
    # One scale away it is a unit vector up to 5e-7.
    torch.testing.assert_close(found, torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), rtol=0, atol=1e-6)
    found.sum().backward()
    assert torch.isfinite(vectors.grad).all()


def test_the_largest_lobe_bounds_every_reflection() -> None:
    gloss = Gloss(torch.tensor([[0.1, 0.3, 0.2], [0.0, 0.0, 0.0]]), torch.tensor([8.0, 50.0]))
    assert largest_lobe(gloss).tolist() == pytest.approx([1.5, 0.0])
    peak = math.pi * gloss.reflectance.amax(dim=1) * phong_lobe(torch.ones(2), gloss.exponents)
    torch.testing.assert_close(largest_lobe(gloss), peak)
