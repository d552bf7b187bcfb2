"""Spots in spherical harmonics: their coefficients, how they converge, and their derivatives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from emitters import emitter_at
from rgspipe.renderer.unit_light import emitted_intensity
from rgspipe.renderer.zonal_harmonics import BandLimit, legendre, zonal_coefficients
from rgspipe.scene.lights import SpotLight

SHAPES = {
    "gaussian": SpotLight.shaped("gaussian", 0.4, 0.15),
    "smoothstep": SpotLight.shaped("smoothstep", 0.6, 0.5),
    "linear": SpotLight.shaped("linear", 0.7, 0.3),
}
HARD = SpotLight.shaped("smoothstep", 0.7, 0.0)


def expansion(shape: SpotLight, band: BandLimit, angle: Tensor) -> Tensor:
    return legendre(torch.cos(angle), band.degree)[0] @ zonal_coefficients(shape, band)[0]


def reference_intensity(points: Tensor, position: Tensor, axis: Tensor, shape: SpotLight, band: BandLimit) -> Tensor:
    """(N,) as it is defined, in float64: NumPy's series, differentiable by finite differences alone."""
    towards = points - position
    cosine = (towards @ (axis / axis.norm())) / towards.norm(dim=1)
    series = np.polynomial.Legendre(zonal_coefficients(shape, band)[0].numpy())
    return torch.from_numpy(series(cosine.numpy()))


def test_polynomials_are_numpy_s_and_so_are_their_slopes() -> None:
    z = torch.linspace(-1.0, 1.0, 41, dtype=torch.float64)
    values, slopes = legendre(z, 12)
    for order in range(13):
        series = np.polynomial.Legendre.basis(order)
        np.testing.assert_allclose(values[:, order], series(z.numpy()), atol=1e-14)  # measured 2e-15
        np.testing.assert_allclose(slopes[:, order], series.deriv()(z.numpy()), atol=1e-12)  # measured 6e-14


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_low_degrees_have_their_columns(degree: int) -> None:
    values, slopes = legendre(torch.tensor([0.5], dtype=torch.float64), degree)
    assert values[0].tolist() == [1.0, 0.5, -0.125][: degree + 1]
    assert slopes[0].tolist() == [0.0, 1.0, 1.5][: degree + 1]


def test_a_hard_cone_has_the_coefficients_of_its_closed_form() -> None:
    """∫ P_l over a cap is (P_{l−1} − P_{l+1}) / (2l + 1) at its edge."""
    edge = torch.tensor([math.cos(HARD.cone_angle)], dtype=torch.float64)
    polynomials = legendre(edge, 17)[0][0]
    expected = torch.cat([0.5 * (1.0 - edge), 0.5 * (polynomials[:-2] - polynomials[2:])])
    found = zonal_coefficients(HARD, BandLimit(16, mirrored=False))[0]
    torch.testing.assert_close(found, expected, atol=1e-12, rtol=0)  # measured 3e-15


def test_a_full_smoothstep_is_a_cubic_of_the_cosine_and_ends_there() -> None:
    """With blend 1 and a cone of π the share is y²(3 − 2y) of y = (1 + z)/2: powers of the cosine up to the third."""
    shape = SpotLight.shaped("smoothstep", math.pi, 1.0)
    found = zonal_coefficients(shape, BandLimit(6, mirrored=False))[0]
    y = np.polynomial.Polynomial([0.5, 0.5])
    expected = np.zeros(7)
    expected[:4] = (y**2 * (3 - 2 * y)).convert(kind=np.polynomial.Legendre).coef
    np.testing.assert_allclose(found, expected, atol=1e-13)  # measured 2e-15


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("mirrored", [False, True])
def test_the_expansion_converges_to_the_profile(name: str, mirrored: bool) -> None:
    angle = torch.linspace(0.0, 0.5 * math.pi, 400, dtype=torch.float64)
    exact = SHAPES[name].relative_intensity_at(angle)
    errors = [
        float((expansion(SHAPES[name], BandLimit(degree, mirrored), angle) - exact).square().mean().sqrt())
        for degree in (2, 8, 32)
    ]
    # Measured at most 0.32, 0.14 and 0.016 (smoothstep, the sharpest rim), ratios at most 0.45 and 0.12.
    assert errors[1] < 0.6 * errors[0] and errors[2] < 0.2 * errors[1] and errors[2] < 0.03


def test_one_sided_light_stays_in_front_and_mirrored_light_does_not() -> None:
    angle = torch.linspace(0.0, math.pi, 181, dtype=torch.float64)
    mirrored, one_sided = (expansion(SHAPES["gaussian"], BandLimit(32, both), angle) for both in (True, False))
    torch.testing.assert_close(mirrored, mirrored.flip(0), atol=1e-12, rtol=0)
    assert float(mirrored[-1]) == pytest.approx(1.0, abs=0.03)  # measured 1.010
    assert float(one_sided[91:].abs().max()) < 1e-3  # measured 8e-5
    coefficients, slopes = zonal_coefficients(SHAPES["gaussian"], BandLimit(9))
    for column in (coefficients, *slopes.values()):
        assert torch.equal(column[1::2], torch.zeros(5).double())


def test_derivatives_of_the_coefficients_are_those_of_finite_differences() -> None:
    step, band = 1e-6, BandLimit(8)
    for name, shape in SHAPES.items():
        _, slopes = zonal_coefficients(shape, band, softness=0.1)
        for number, found in slopes.items():
            moved = [replace(shape, **{number: getattr(shape, number) + sign * step}) for sign in (1.0, -1.0)]
            ends = [zonal_coefficients(one, band, softness=0.1)[0] for one in moved]
            expected = (ends[0] - ends[1]) / (2.0 * step)
            assert float((found - expected).abs().max()) < 1e-8, name  # measured 8e-10


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("mirrored", [False, True])
def test_the_relative_intensity_is_the_series_and_its_slopes_those_of_finite_differences(
    name: str, mirrored: bool
) -> None:
    generator = torch.Generator().manual_seed(0)
    points = torch.randn((60, 3), generator=generator, dtype=torch.float64)
    position, axis = torch.tensor([0.1, -0.2, 0.3]).double(), torch.tensor([0.3, 0.5, -0.8]).double()
    axis, shape, band = axis / axis.norm(), SHAPES[name], BandLimit(12, mirrored)
    found = emitted_intensity(emitter_at(position, axis, shape), points, band)
    expected = reference_intensity(points, position, axis, shape, band)
    torch.testing.assert_close(found.value.double(), expected, atol=3e-6, rtol=0)  # measured 6e-7
    step = 1e-6
    for index in range(3):
        move = step * torch.eye(3, dtype=torch.float64)[index]
        along = [reference_intensity(points, position + sign * move, axis, shape, band) for sign in (1.0, -1.0)]
        turned = [reference_intensity(points, position, axis + sign * move, shape, band) for sign in (1.0, -1.0)]
        for slope, ends in ((found.by["position"], along), (found.by["direction"], turned)):
            difference = (ends[0] - ends[1]) / (2.0 * step)
            size = max(1.0, float(difference.abs().max()))
            assert float((slope[:, index].double() - difference).abs().max()) < 1e-5 * size  # measured 2e-6


def test_a_softer_rim_is_what_is_expanded() -> None:
    angle = torch.linspace(0.0, 1.5, 100, dtype=torch.float64)
    axis, origin = torch.tensor([0.0, 0.0, 1.0]).double(), torch.zeros(3).double()
    points = torch.stack([torch.sin(angle), torch.zeros_like(angle), torch.cos(angle)], dim=1)
    found = emitted_intensity(emitter_at(origin, axis, HARD, softness=0.3), points, BandLimit(32))
    exact, _ = HARD.profile_at(angle, HARD.numbers(angle), 0.3)
    assert float((found.value - exact).abs().max()) < 3e-3  # measured 1.3e-3


def test_without_a_band_the_relative_intensity_is_exact() -> None:
    points = torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.4, 1.0], [0.0, 0.0, -1.0]]).double()
    axis, origin = torch.tensor([0.0, 0.0, 1.0]).double(), torch.zeros(3).double()
    angle = torch.tensor([0.0, math.atan(0.4), math.pi]).double()
    found = emitted_intensity(emitter_at(origin, axis, SHAPES["smoothstep"]), points, None)
    torch.testing.assert_close(
        found.value.double(), SHAPES["smoothstep"].relative_intensity_at(angle), atol=1e-6, rtol=0
    )


def test_a_negative_degree_is_refused() -> None:
    with pytest.raises(ValueError, match="degree"):
        BandLimit(-1)
