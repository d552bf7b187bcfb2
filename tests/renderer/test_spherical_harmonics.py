"""Spherical harmonics: orthonormal, rotation-invariant in sum, and smooth at the poles, in both precisions."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.special
import torch
from torch import Tensor

from rgspipe.renderer.spherical_harmonics import (
    coefficient_count,
    per_harmonic,
    real_harmonics,
    real_harmonics_and_slopes,
)

DEGREE = 8


def sphere_quadrature(nodes: int = 24) -> tuple[Tensor, Tensor]:
    """Directions (Q, 3) and weights (Q,) that integrate polynomials of degree 2·nodes − 1 exactly over the sphere."""
    z, weights = np.polynomial.legendre.leggauss(nodes)
    angles = 2.0 * np.pi * np.arange(2 * nodes) / (2 * nodes)
    ring = np.sqrt(1.0 - z**2)[:, None]
    points = np.stack([ring * np.cos(angles), ring * np.sin(angles), np.broadcast_to(z[:, None], (nodes, 2 * nodes))])
    share = np.repeat(weights * np.pi / nodes, 2 * nodes)
    return torch.from_numpy(points.reshape(3, -1).T.copy()), torch.from_numpy(share)


def random_directions(count: int, seed: int = 0) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.nn.functional.normalize(torch.randn(count, 3, generator=generator, dtype=torch.float64), dim=1)


def test_harmonics_are_orthonormal() -> None:
    directions, weights = sphere_quadrature()
    values = real_harmonics(directions, DEGREE)
    products = torch.einsum("q,qa,qb->ab", weights, values, values)
    # Measured 3e-15.
    torch.testing.assert_close(products, torch.eye(coefficient_count(DEGREE)).double(), rtol=0, atol=1e-12)


def test_low_degrees_are_the_known_polynomials() -> None:
    x, y, z = random_directions(50).unbind(-1)
    first = 0.5 * math.sqrt(3.0 / math.pi)
    expected = torch.stack([torch.full_like(x, 0.5 / math.sqrt(math.pi)), first * y, first * z, first * x], dim=-1)
    values = real_harmonics(torch.stack([x, y, z], dim=-1), 2)
    torch.testing.assert_close(values[:, :4], expected, rtol=1e-13, atol=0)
    torch.testing.assert_close(values[:, 8], 0.25 * math.sqrt(15.0 / math.pi) * (x * x - y * y), rtol=1e-12, atol=1e-14)


def test_addition_theorem() -> None:
    """Σ_m Y_lm(a) Y_lm(b) = (2l + 1)/(4π) P_l(a·b) for every degree."""
    a, b = random_directions(40), random_directions(40, seed=1)
    products = real_harmonics(a, DEGREE) * real_harmonics(b, DEGREE)
    cosines = (a * b).sum(-1)
    for order in range(DEGREE + 1):
        found = products[:, order**2 : (order + 1) ** 2].sum(dim=1)
        legendre = torch.from_numpy(scipy.special.eval_legendre(order, cosines.numpy()))
        # Measured 2e-15.
        torch.testing.assert_close(found, (2 * order + 1) / (4.0 * math.pi) * legendre, rtol=0, atol=1e-12)


def test_single_precision_is_as_good_as_its_rounding() -> None:
    directions = random_directions(2000)
    single = real_harmonics(directions.float(), DEGREE)
    # Measured 2.1e-6, of values up to 1.6.
    torch.testing.assert_close(single.double(), real_harmonics(directions, DEGREE), rtol=0, atol=1e-5)


@pytest.mark.parametrize("pole", [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
def test_derivatives_are_finite_and_right_at_the_poles(pole: list[float]) -> None:
    point = torch.tensor(pole, dtype=torch.float64, requires_grad=True)
    # A polynomial has no trouble with points beside the sphere, so plain finite differences hold.
    assert torch.autograd.gradcheck(lambda v: real_harmonics(v, DEGREE), (point,), eps=1e-6, atol=1e-6)
    assert torch.isfinite(torch.autograd.functional.jacobian(lambda v: real_harmonics(v, DEGREE), point.float())).all()


def test_slopes_are_those_of_autograd() -> None:
    points = torch.cat([random_directions(20), torch.eye(3).double(), -torch.eye(3).double()])
    values, slopes = real_harmonics_and_slopes(points, DEGREE)
    assert torch.equal(values, real_harmonics(points, DEGREE))
    # One point's harmonics do not depend on another's direction, so the sum has the derivatives of all.
    summed = torch.autograd.functional.jacobian(lambda v: real_harmonics(v, DEGREE).sum(dim=0), points)
    expected = summed.transpose(0, 1)
    # Measured 2.5e-14.
    torch.testing.assert_close(slopes, expected, rtol=0, atol=1e-12)


def test_a_degree_s_value_is_repeated_for_its_harmonics() -> None:
    assert per_harmonic(torch.tensor([[1.0, 2.0, 3.0]])).tolist() == [[1.0, 2, 2, 2, 3, 3, 3, 3, 3]]
