"""Spots in closed form: profiles, power, and derivatives on and off the axis."""

from __future__ import annotations

import math

import pytest
import torch
from scipy.stats import qmc

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.spot import angle_from_axis, spot_power, spot_profile, spot_share
from rgspipe.scene import PointLight, SpotLight
from rooms import rectangle, surfels_on

AXES = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, -0.48, 0.64]]


def spot(profile: str, cone: float, falloff: float, axis: list[float] = AXES[4]) -> SpotLight:
    position = torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64)
    return SpotLight(
        position, torch.tensor([1.0, 2.0, 0.5]).double(), torch.tensor(axis).double(), profile, cone, falloff
    )


@pytest.mark.parametrize(
    ("profile", "cone", "falloff"),
    [
        ("gaussian", 0.5, 0.1),
        ("gaussian", 0.0, 0.3),
        ("gaussian", 1.0, 0.0),
        ("gaussian", math.pi, 0.1),
        ("gaussian", math.pi / 2, 0.5),
        ("smoothstep", 0.6, 0.15),
        ("smoothstep", 0.6, 1.0),
        ("smoothstep", 0.6, 0.0),
        ("linear", 0.7, 0.5),
        ("linear", 0.7, 0.7),
    ],
)
def test_power_is_the_integral_over_all_directions(profile: str, cone: float, falloff: float) -> None:
    """As pbrt tests its lights: power against a quasi-Monte-Carlo integral, within 1e-3."""
    light = spot(profile, cone, falloff)
    u = torch.from_numpy(qmc.Sobol(2, seed=0).random(2**18))
    z, turn = 1.0 - 2.0 * u[:, 0], 2.0 * math.pi * u[:, 1]
    ring = (1.0 - z * z).clamp(min=0.0).sqrt()
    directions = torch.stack([ring * turn.cos(), ring * turn.sin(), z], dim=1)
    sampled = 4.0 * math.pi * spot_share(light, light.position + directions).mean()
    # Measured up to 2e-4, at the hard edges.
    assert float(spot_power(light)[0]) == pytest.approx(float(sampled), rel=1e-3)


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
