"""Spots in closed form: power, and derivatives on and off the axis."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from rgspipe.errors import InputError
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight, SpotLight
from rgspipe.scene.lights.angles import angle_from_axis, angle_slopes
from rooms import rectangle, surfels_on
from sampled_power import sampled_power

AXES = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, -0.48, 0.64]]


def spot(profile: str, cone: float, falloff: float, axis: list[float] = AXES[4]) -> SpotLight:
    position = torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64)
    return SpotLight(
        position, torch.tensor([1.0, 2.0, 0.5]).double(), torch.tensor(axis).double(), profile, cone, falloff
    )


@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
@pytest.mark.parametrize("cone", [0.02, 0.3, 1.0, math.pi / 2, 2.5, math.pi])
@pytest.mark.parametrize("falloff", [0.0, 0.01, 0.2, 1.0])
def test_power_is_the_integral_over_all_directions(profile: str, cone: float, falloff: float) -> None:
    """As pbrt tests its lights: power against a quasi-Monte-Carlo integral, within 1e-3."""
    light = spot(profile, cone, falloff)
    # All the light is within the cone, but for the rim of a Gaussian; samples elsewhere would be zeros.
    limit = min(math.pi, cone + 8.0 * falloff if profile == "gaussian" else cone)
    # Measured below 3e-5.
    torch.testing.assert_close(light.power(), sampled_power(light, limit), rtol=1e-3, atol=0.0)


def test_a_spot_of_no_width_has_no_power() -> None:
    assert float(spot("gaussian", 0.0, 0.0).power().abs().max()) < 1e-15
    # A Gaussian of no cone is a lobe: 2π ∫ exp(−θ²/2σ²) sin θ dθ ≈ 2πσ² (1 − σ²/3 + σ⁴/15).
    width = 0.1
    expected = 2.0 * math.pi * width**2 * (1.0 - width**2 / 3.0 + width**4 / 15.0)
    # Measured 1e-8.
    assert float(spot("gaussian", 0.0, width).power()[0]) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
@pytest.mark.parametrize("cone", [0.0, math.pi / 4, math.pi / 2, math.pi])
@pytest.mark.parametrize("falloff", [0.0, 0.3])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_values_and_derivatives_are_finite_everywhere(profile: str, cone: float, falloff: float, dtype) -> None:
    light = spot(profile, cone, falloff, AXES[0])
    axis = light.direction.to(dtype).clone().requires_grad_()
    position = light.position.to(dtype).clone().requires_grad_()
    offsets = torch.tensor([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 0, 0], [1e-12, 0, 1], [1, 1, 1]], dtype=dtype)
    relative = replace(light, position=position, direction=axis).relative_intensity_towards(position.detach() + offsets)
    relative.sum().backward()
    for value in (relative, axis.grad, position.grad):
        assert torch.isfinite(value).all()
    assert float(relative.detach().min()) >= 0.0 and float(relative.detach().max()) <= 1.0


@pytest.mark.parametrize(("profile", "falloff"), [("gaussian", 0.2), ("smoothstep", 0.5), ("linear", 0.3)])
def test_derivatives_match_finite_differences(profile: str, falloff: float) -> None:
    light = spot(profile, 0.8, falloff)
    points = torch.randn(20, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    position, axis = light.position.clone().requires_grad_(), light.direction.clone().requires_grad_()

    def relative(position: torch.Tensor, axis: torch.Tensor) -> torch.Tensor:
        return replace(light, position=position, direction=axis).relative_intensity_towards(points)

    assert torch.autograd.gradcheck(relative, (position, axis), atol=1e-6)


@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
@pytest.mark.parametrize("cone", [0.05, 1.0, 2.5])
@pytest.mark.parametrize("falloff", [0.0, 0.04, 0.5])
def test_slopes_are_those_of_autograd(profile: str, cone: float, falloff: float) -> None:
    """The analytic derivatives of profile and angle, which fits use, together."""
    generator = torch.Generator().manual_seed(0)
    towards = torch.randn(500, 3, generator=generator, dtype=torch.float64)
    axis = torch.tensor([0.3, -0.5, 0.9], dtype=torch.float64)
    leaves = towards.clone().requires_grad_(), axis.expand(500, 3).clone().requires_grad_()
    angle = angle_from_axis(leaves[1], leaves[0])
    light = spot(profile, cone, falloff)
    value, slope = light.profile_at(angle, light.numbers(angle))
    if value.requires_grad:
        value.sum().backward()
    again, by_towards, by_axis = angle_slopes(axis, towards)
    assert torch.equal(again, angle)
    for leaf, by in zip(leaves, (by_towards, by_axis), strict=True):
        expected = torch.zeros_like(by) if leaf.grad is None else leaf.grad
        # Measured 1e-13 of the largest.
        torch.testing.assert_close(slope.detach()[:, None] * by, expected, rtol=0, atol=1e-10)


def test_a_spot_of_half_turn_lights_like_a_point_light() -> None:
    floor, up = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0], 0.1)
    scene = FrozenScene.freeze(surfels_on(floor, up, 0.1), gather_rays=16, patches=20, seed=0)
    light = spot("gaussian", math.pi, 0.1)
    as_spot, as_point = scene.radiance_of((light,)), scene.radiance_of((PointLight(light.position, light.intensity),))
    assert torch.equal(as_spot, as_point)
    narrow = scene.radiance_of((spot("gaussian", 0.3, 0.0, AXES[1]),))
    inside = (floor[:, :2] - torch.tensor([0.1, -0.2])).norm(dim=1) < 0.3 * math.tan(0.3)
    torch.testing.assert_close(narrow[inside], as_point[inside])
    assert float(narrow[~inside].abs().max()) == 0.0


def test_a_hard_edge_has_no_rim() -> None:
    assert SpotLight.shaped("gaussian", 0.4, 0.0).rim == SpotLight.shaped("linear", 0.4, 0.4).rim == 0.0
    assert SpotLight.shaped("gaussian", 0.4, 0.1).rim == pytest.approx(0.1)


@pytest.mark.parametrize(("profile", "cone", "falloff"), [("gaussian", 2.0 * math.pi, 0.1), ("linear", 0.4, -0.1)])
def test_angles_out_of_range_are_refused(profile: str, cone: float, falloff: float) -> None:
    with pytest.raises(InputError, match=r"cone_angle: .*6.28|falloff: .*-0.1"):
        SpotLight.shaped(profile, cone, falloff)


def test_profiles_of_no_name_are_refused() -> None:
    with pytest.raises(InputError, match="gaussian, smoothstep, linear"):
        SpotLight.shaped("round")
