"""Profiles of spots: those of other programs, their slopes, and what softening a rim keeps."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from rgspipe.scene.lights.spot_profiles import PROFILES, softened


def profile_at(name: str, angle: Tensor, cone: float, falloff: float) -> tuple[Tensor, Tensor]:
    return PROFILES[name](angle, *torch.tensor([cone, falloff], dtype=torch.float64).to(angle))


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("cone", [0.05, 1.0, 2.5])
@pytest.mark.parametrize("falloff", [0.0, 0.04, 0.5])
def test_slopes_are_those_of_autograd(name: str, cone: float, falloff: float) -> None:
    """The analytic derivatives towards the angle, which fits use."""
    generator = torch.Generator().manual_seed(0)
    angle = (math.pi * torch.rand(500, generator=generator, dtype=torch.float64)).requires_grad_()
    value, slope = profile_at(name, angle, cone, falloff)
    if value.requires_grad:
        value.sum().backward()
    expected = torch.zeros_like(slope) if angle.grad is None else angle.grad
    # Measured 6e-16 of the largest.
    torch.testing.assert_close(slope.detach(), expected, rtol=0, atol=1e-10)


def test_narrow_cones_keep_their_digits_in_float32() -> None:
    angles = torch.linspace(0.0, 0.02, 200, dtype=torch.float64)
    exact, _ = profile_at("smoothstep", angles, 0.015, 0.5)
    found, _ = profile_at("smoothstep", angles.float(), 0.015, 0.5)
    # Measured 3e-7; by the difference of two cosines it would be 1e-3.
    torch.testing.assert_close(found.double(), exact, atol=3e-6, rtol=0)


def test_blender_s_profile_has_its_blend() -> None:
    """Half-way (in the cosine) through the blend the smoothstep is one half; inside it is 1, outside 0."""
    cone, blend = 0.6, 0.5
    edge = math.cos(cone)
    middle = math.acos(edge + 0.5 * blend * (1.0 - edge))
    angles = torch.tensor([0.0, middle, cone, cone + 0.1], dtype=torch.float64)
    expected = torch.tensor([1.0, 0.5, 0.0, 0.0], dtype=torch.float64)
    torch.testing.assert_close(profile_at("smoothstep", angles, cone, blend)[0], expected, atol=1e-12, rtol=0)


@pytest.mark.parametrize(
    ("name", "cone", "falloff"), [("gaussian", 0.4, 0.2), ("smoothstep", 0.7, 0.6), ("linear", 0.7, 0.3)]
)
def test_a_softened_rim_is_wider_and_falls_to_one_half_at_the_same_angle(
    name: str, cone: float, falloff: float
) -> None:
    rim = torch.tensor([cone, falloff], dtype=torch.float64)
    angle = torch.linspace(0.0, math.pi, 20001, dtype=torch.float64)
    halves, widths = [], []
    for width in (0.0, 0.1):
        profile, *softer = softened(PROFILES[name], *rim, width)
        value, _ = profile(angle, *softer)
        halves.append(float(angle[(value < 0.5).nonzero()[0, 0]]))
        widths.append(float(angle[(value < 0.1).nonzero()[0, 0]]) - float(angle[(value < 0.9).nonzero()[0, 0]]))
    assert halves[0] == pytest.approx(halves[1], abs=2e-4)
    assert widths[1] > widths[0] + 0.01
