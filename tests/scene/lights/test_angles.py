"""Angles from an axis: exact on it, and their derivatives."""

from __future__ import annotations

import math

import pytest
import torch

from rgspipe.scene.lights.angles import angle_from_axis, angle_slopes

AXES = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, -0.48, 0.64]]


@pytest.mark.parametrize("axis", AXES)
def test_angles_are_exact_along_and_against_the_axis(axis: list[float]) -> None:
    direction = torch.tensor(axis, dtype=torch.float64)
    angles = angle_from_axis(direction, torch.stack([direction, -direction, 3.0 * direction]))
    torch.testing.assert_close(angles, torch.tensor([0.0, math.pi, 0.0], dtype=torch.float64), atol=2e-9, rtol=0)


def test_slopes_are_those_of_autograd() -> None:
    generator = torch.Generator().manual_seed(0)
    towards = torch.randn(500, 3, generator=generator, dtype=torch.float64)
    axis = torch.tensor([0.3, -0.5, 0.9], dtype=torch.float64)
    leaves = towards.clone().requires_grad_(), axis.expand(500, 3).clone().requires_grad_()
    angle = angle_from_axis(leaves[1], leaves[0])
    angle.sum().backward()
    again, by_towards, by_axis = angle_slopes(axis, towards)
    assert torch.equal(again, angle)
    for leaf, by in zip(leaves, (by_towards, by_axis), strict=True):
        # Measured 9e-16 of slopes up to 7.
        torch.testing.assert_close(by, leaf.grad, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_slopes_are_finite_on_the_axis_and_at_the_light(dtype: torch.dtype) -> None:
    axis = torch.tensor([0.0, 0.0, 1.0], dtype=dtype)
    towards = torch.tensor([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 0, 0], [1e-12, 0, 1], [1, 1, 1]], dtype=dtype)
    for value in angle_slopes(axis, towards):
        assert torch.isfinite(value).all()
