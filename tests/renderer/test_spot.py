"""Spots in closed form: profiles, power, and derivatives on and off the axis."""

from __future__ import annotations

import math

import pytest
import torch
from scipy.stats import qmc

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.spot import angle_from_axis, angle_slopes, spot_power, spot_profile, spot_share
from rgspipe.scene import PointLight, SpotLight
from rooms import rectangle, surfels_on

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
    u = torch.from_numpy(qmc.Sobol(2, seed=0).random(2**14))
    height, turn = 1.0 - (1.0 - math.cos(limit)) * u[:, 0], 2.0 * math.pi * u[:, 1]
    ring = (1.0 - height * height).clamp(min=0.0).sqrt()
    x, y = torch.linalg.qr(torch.stack([light.direction, *torch.eye(3).double()[:2]], dim=1))[0][:, 1:].T
    directions = height[:, None] * light.direction + ring[:, None] * (turn.cos()[:, None] * x + turn.sin()[:, None] * y)
    sampled = 2.0 * math.pi * (1.0 - math.cos(limit)) * spot_share(light, light.position + directions).mean()
    # Measured below 3e-5.
    assert float(spot_power(light)[0]) == pytest.approx(float(sampled), rel=1e-3)


def test_a_spot_of_no_width_has_no_power() -> None:
    assert float(spot_power(spot("gaussian", 0.0, 0.0)).abs().max()) < 1e-15
    # A Gaussian of no cone is a lobe: 2π ∫ exp(−θ²/2σ²) sin θ dθ ≈ 2πσ² (1 − σ²/3 + σ⁴/15).
    width = 0.1
    expected = 2.0 * math.pi * width**2 * (1.0 - width**2 / 3.0 + width**4 / 15.0)
    # Measured 1e-8.
    assert float(spot_power(spot("gaussian", 0.0, width))[0]) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("axis", AXES)
def test_angles_are_exact_along_and_against_the_axis(axis: list[float]) -> None:
    direction = torch.tensor(axis, dtype=torch.float64)
    angles = angle_from_axis(direction, torch.stack([direction, -direction, 3.0 * direction]))
    torch.testing.assert_close(angles, torch.tensor([0.0, math.pi, 0.0], dtype=torch.float64), atol=2e-9, rtol=0)


@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
@pytest.mark.parametrize("cone", [0.0, math.pi / 4, math.pi / 2, math.pi])
@pytest.mark.parametrize("falloff", [0.0, 0.3])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_values_and_derivatives_are_finite_everywhere(profile: str, cone: float, falloff: float, dtype) -> None:
    light = spot(profile, cone, falloff, AXES[0])
    axis = light.direction.to(dtype).clone().requires_grad_()
    position = light.position.to(dtype).clone().requires_grad_()
    offsets = torch.tensor([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 0, 0], [1e-12, 0, 1], [1, 1, 1]], dtype=dtype)
    share = spot_share(light, position.detach() + offsets, position, axis)
    share.sum().backward()
    for value in (share, axis.grad, position.grad):
        assert torch.isfinite(value).all()
    assert float(share.detach().min()) >= 0.0 and float(share.detach().max()) <= 1.0


@pytest.mark.parametrize(("profile", "falloff"), [("gaussian", 0.2), ("smoothstep", 0.5), ("linear", 0.3)])
def test_derivatives_match_finite_differences(profile: str, falloff: float) -> None:
    light = spot(profile, 0.8, falloff)
    points = torch.randn(20, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    position, axis = light.position.clone().requires_grad_(), light.direction.clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda p, a: spot_share(light, points, p, a), (position, axis), atol=1e-6)


@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
@pytest.mark.parametrize("cone", [0.05, 1.0, 2.5])
@pytest.mark.parametrize("falloff", [0.0, 0.04, 0.5])
def test_slopes_are_those_of_autograd(profile: str, cone: float, falloff: float) -> None:
    """The analytic derivatives of profile and angle, which fits use, for spots of all shapes at once."""
    generator = torch.Generator().manual_seed(0)
    towards = torch.randn(500, 3, generator=generator, dtype=torch.float64)
    axis = torch.tensor([0.3, -0.5, 0.9], dtype=torch.float64)
    leaves = towards.clone().requires_grad_(), axis.expand(500, 3).clone().requires_grad_()
    angle = angle_from_axis(leaves[1], leaves[0])
    value, slope = spot_profile(profile, angle, cone, falloff)
    if value.requires_grad:
        value.sum().backward()
    again, by_towards, by_axis = angle_slopes(axis, towards)
    assert torch.equal(again, angle)
    for leaf, by in zip(leaves, (by_towards, by_axis), strict=True):
        expected = torch.zeros_like(by) if leaf.grad is None else leaf.grad
        # Measured 1e-13 of the largest.
        torch.testing.assert_close(slope.detach()[:, None] * by, expected, rtol=0, atol=1e-10)


def test_narrow_cones_keep_their_digits_in_float32() -> None:
    angles = torch.linspace(0.0, 0.02, 200, dtype=torch.float64)
    exact, _ = spot_profile("smoothstep", angles, 0.015, 0.5)
    # Measured 3e-7; by the difference of two cosines it would be 1e-3.
    torch.testing.assert_close(
        spot_profile("smoothstep", angles.float(), 0.015, 0.5)[0].double(), exact, atol=3e-6, rtol=0
    )


def test_blender_s_profile_has_its_blend() -> None:
    """Half-way (in the cosine) through the blend the smoothstep is one half; inside it is 1, outside 0."""
    cone, blend = 0.6, 0.5
    edge = math.cos(cone)
    middle = math.acos(edge + 0.5 * blend * (1.0 - edge))
    angles = torch.tensor([0.0, middle, cone, cone + 0.1], dtype=torch.float64)
    expected = torch.tensor([1.0, 0.5, 0.0, 0.0], dtype=torch.float64)
    torch.testing.assert_close(spot_profile("smoothstep", angles, cone, blend)[0], expected, atol=1e-12, rtol=0)


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
