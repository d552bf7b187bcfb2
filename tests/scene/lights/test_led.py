"""LEDs in closed form: power, half-angles, derivatives, and cases where a power of a cosine goes wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from rgspipe.scene import PointLight
from rgspipe.scene.lights import LedLight
from sampled_power import sampled_power

PLACE = torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64)
AXIS = torch.tensor([0.6, -0.48, 0.64], dtype=torch.float64)
COLOUR = torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64)


def led(exponent: float) -> LedLight:
    return LedLight(PLACE, COLOUR, AXIS, exponent)


def profile(exponent: float | Tensor, angle: Tensor, softness: float = 0.0) -> tuple[Tensor, Tensor]:
    return LedLight.shaped().profile_at(angle, {"exponent": torch.as_tensor(exponent, dtype=angle.dtype)}, softness)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 4.0, 30.0, 1000.0])
def test_power_is_that_of_the_closed_form_and_of_the_integral(exponent: float) -> None:
    light, expected = led(exponent), 2.0 * math.pi * COLOUR / (exponent + 1.0)
    # Measured 1.2e-6 for m = 0.5, whose slope is infinite at the horizon, and 4e-15 for all others.
    torch.testing.assert_close(light.power(), expected, rtol=5e-6, atol=0.0)
    limit = min(0.5 * math.pi, 9.0 * exponent**-0.5) if exponent > 0.0 else 0.5 * math.pi
    # Measured 3e-8.
    torch.testing.assert_close(sampled_power(light, limit), expected, rtol=1e-5, atol=0.0)


@pytest.mark.parametrize(("degrees", "exponent"), [(2.0, 1137.4), (15.0, 19.99), (60.0, 1.0), (80.0, 0.3959)])
def test_intensity_falls_to_one_half_at_the_half_angle(degrees: float, exponent: float) -> None:
    """The exponent of a data sheet's half-angle is ln ½ / ln cos."""
    half = math.radians(degrees)
    assert exponent == pytest.approx(math.log(0.5) / math.log(math.cos(half)), rel=1e-3)
    exponent = math.log(0.5) / math.log(math.cos(half))
    relative, _ = profile(exponent, torch.tensor([0.0, half, math.pi - half], dtype=torch.float64))
    torch.testing.assert_close(relative, torch.tensor([1.0, 0.5, 0.0]).double(), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.5, 20.0, 1000.0])
@pytest.mark.parametrize("softness", [0.0, 0.15])
def test_slopes_are_those_of_finite_differences(exponent: float, softness: float) -> None:
    angle, step = torch.linspace(0.01, 1.5, 300, dtype=torch.float64), 1e-6
    _, slope = profile(exponent, angle, softness)
    ahead, behind = (profile(exponent, angle + sign * step, softness)[0] for sign in (1.0, -1.0))
    expected = (ahead - behind) / (2.0 * step)
    # Over the largest: measured 1.6e-9.
    assert float((slope - expected).abs().max() / expected.abs().max()) < 1e-8

    free = torch.full_like(angle, exponent).requires_grad_()
    profile(free, angle, softness)[0].sum().backward()
    step *= exponent
    ahead, behind = (profile(exponent + sign * step, angle, softness)[0] for sign in (1.0, -1.0))
    expected = (ahead - behind) / (2.0 * step)
    assert float((free.grad - expected).abs().max() / expected.abs().max()) < 1e-8  # measured 2.9e-9


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 1000.0])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("softness", [0.0, 0.15])
def test_values_and_gradients_are_finite_everywhere(exponent: float, dtype: torch.dtype, softness: float) -> None:
    """On the axis, behind, at the light itself, exactly at the horizon and next to it."""
    towards = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 0, 0], [1e-12, 0, 1], [1, 0, 1e-7], [1, 0, -1e-7], [1, 1, 1]]
    place = torch.tensor([0.1, -0.2, 0.3], dtype=dtype, requires_grad=True)
    axis = torch.tensor([0.0, 0.0, 1.0], dtype=dtype, requires_grad=True)
    free = torch.tensor(exponent, dtype=dtype, requires_grad=True)
    light = LedLight(place, COLOUR, axis, free)
    points = place.detach() + torch.tensor(towards, dtype=dtype)
    relative = light.relative_intensity_towards(points)
    relative.sum().backward()
    for value in (relative, place.grad, axis.grad, free.grad):
        assert torch.isfinite(value).all()
    assert float(relative.detach().min()) >= 0.0 and float(relative.detach().max()) <= 1.0
    analytic = light.relative_intensity(points, softness=softness, shape_free=True)
    for value in (analytic.value, *analytic.by.values()):
        assert torch.isfinite(value).all()


def test_behind_an_led_it_is_dark_whatever_the_exponent() -> None:
    behind = PLACE - torch.rand(50, 1, generator=torch.Generator().manual_seed(0)) * AXIS
    for exponent in (0.0, 0.5, 1.0, 1000.0):
        assert (
            float(led(exponent).relative_intensity_towards(behind).max())
            == led(exponent).least_relative_intensity
            == 0.0
        )


def test_a_lambertian_led_is_a_small_square_that_glows() -> None:
    """The relative intensity of an exponent of 1 is the cosine, that of 0 is 1 in front."""
    angle = torch.linspace(0.0, 1.5, 50, dtype=torch.float64)
    torch.testing.assert_close(led(1.0).relative_intensity_at(angle), torch.cos(angle))
    assert torch.equal(led(0.0).relative_intensity_at(angle), torch.ones_like(angle))


def test_a_softer_beam_is_wider_by_as_much_as_a_gaussian_s() -> None:
    """Variances add: with 1/m + s² in the place of 1/m."""
    narrow, wide = led(100.0), 1.0 / (1.0 / 100.0 + 0.15**2)
    angle = torch.linspace(0.0, 1.0, 50, dtype=torch.float64)
    softened, _ = narrow.profile_at(angle, narrow.numbers(angle), 0.15)
    torch.testing.assert_close(softened, led(wide).relative_intensity_at(angle))
    assert narrow.rim == pytest.approx(0.1)
    # As wide as the Gaussian of that standard deviation; measured 0.2 % of the axial intensity.
    gaussian = torch.exp(-0.5 * (angle / narrow.rim) ** 2)
    assert float((narrow.relative_intensity_at(angle) - gaussian).abs().max()) < 0.01


@pytest.mark.parametrize("exponent", [-0.1, math.nan])
def test_exponents_that_are_none_are_refused(exponent: float) -> None:
    with pytest.raises(ValueError, match="exponent"):
        led(exponent)


def test_the_plainer_light_of_an_led_is_a_point() -> None:
    plain = replace(led(3.0), intensity=2.0 * COLOUR).plain
    assert isinstance(plain, PointLight) and torch.equal(plain.position, PLACE)
    assert torch.equal(plain.intensity, 2.0 * COLOUR)
