"""A spot's share of light and its derivatives against finite differences, and what softening a rim keeps."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from rgspipe.renderer.spot import SpotShape, spot_profile
from rgspipe.renderer.spot_share import rim_width, softened, spot_share_slopes

SHAPES = [SpotShape("gaussian", 0.4, 0.2), SpotShape("smoothstep", 0.7, 0.6), SpotShape("linear", 0.7, 0.3)]

POSITION = torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64)
AXIS = torch.nn.functional.normalize(torch.tensor([0.5, 0.3, -0.8], dtype=torch.float64), dim=0)


def points() -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    return 2.0 * torch.rand(400, 3, generator=generator, dtype=torch.float64) - 1.0


def difference(function, step: float) -> torch.Tensor:
    return (function(step) - function(-step)).double() / (2.0 * step)


@pytest.mark.parametrize("softness", [0.0, 0.15])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_derivatives_agree_with_finite_differences(shape: SpotShape, softness: float) -> None:
    """Median over the points, as a linear rim has kinks; float32 differences, so the step is not small."""
    step, where = 1e-3, points()
    share = spot_share_slopes(where, POSITION, AXIS, shape, softness)
    assert float(share.value.min()) >= 0.0 and float((share.by_cone.abs() > 0.1).float().mean()) > 0.02
    pairs = []
    for k in range(3):
        shift = torch.eye(3, dtype=torch.float64)[k]
        pairs.append(
            (share.by_position[:, k], lambda h, s=shift: _value(where, POSITION + h * s, AXIS, shape, softness))
        )
        across = shift - (shift @ AXIS) * AXIS
        pairs.append(
            (share.by_axis @ across.float(), lambda h, s=across: _value(where, POSITION, AXIS + h * s, shape, softness))
        )
    for name, slope in (("cone_angle", share.by_cone), ("falloff", share.by_falloff)):
        base = getattr(shape, name)
        pairs.append(
            (
                slope,
                lambda h, n=name, b=base: _value(where, POSITION, AXIS, replace(shape, **{n: b + h}), softness),
            )
        )
    for slope, function in pairs:
        expected = difference(function, step)
        error = (slope - expected).abs().quantile(0.95) / expected.abs().max()
        # Measured at most 1.1e-4.
        assert float(error) < 1e-3


@pytest.mark.parametrize("softness", [0.0, 0.15])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_a_cone_that_is_known_changes_nothing_else(shape: SpotShape, softness: float) -> None:
    free = spot_share_slopes(points(), POSITION, AXIS, shape, softness)
    known = spot_share_slopes(points(), POSITION, AXIS, shape, softness, cone_free=False)
    assert known.by_cone is None and known.by_falloff is None
    for name in ("value", "by_position", "by_axis"):
        # Measured: no difference. One cone for all points may round otherwise elsewhere.
        torch.testing.assert_close(getattr(known, name), getattr(free, name), rtol=0.0, atol=2e-6)


def _value(where, position, axis, shape, softness) -> torch.Tensor:
    return spot_share_slopes(where, position, axis, shape, softness).value


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_a_softened_rim_is_wider_and_falls_to_one_half_at_the_same_angle(shape: SpotShape) -> None:
    rim = torch.tensor([shape.cone_angle, shape.falloff], dtype=torch.float64)
    angle = torch.linspace(0.0, math.pi, 20001, dtype=torch.float64)
    halves, widths = [], []
    for width in (0.0, 0.1):
        profile, cone, falloff = softened(shape.profile, rim[0], rim[1], width)
        value, _ = spot_profile(profile, angle, cone, falloff)
        halves.append(float(angle[(value < 0.5).nonzero()[0, 0]]))
        widths.append(float(angle[(value < 0.1).nonzero()[0, 0]]) - float(angle[(value < 0.9).nonzero()[0, 0]]))
    assert halves[0] == pytest.approx(halves[1], abs=2e-4)
    assert widths[1] > widths[0] + 0.01


def test_a_hard_edge_has_no_rim() -> None:
    assert rim_width(SpotShape("gaussian", 0.4, 0.0)) == rim_width(SpotShape("linear", 0.4, 0.4)) == 0.0
    assert rim_width(SpotShape("gaussian", 0.4, 0.1)) == pytest.approx(0.1)
    share = spot_share_slopes(points(), POSITION, AXIS, SpotShape("smoothstep", 0.7, 0.0))
    assert set(share.value.tolist()) == {0.0, 1.0} and torch.isfinite(share.by_cone).all()
