"""A spot's relative intensity and its derivatives against finite differences."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.scene.lights import RelativeIntensity, SpotLight

SHAPES = [
    SpotLight.shaped("gaussian", 0.4, 0.2),
    SpotLight.shaped("smoothstep", 0.7, 0.6),
    SpotLight.shaped("linear", 0.7, 0.3),
]

POSITION = torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64)
AXIS = torch.nn.functional.normalize(torch.tensor([0.5, 0.3, -0.8], dtype=torch.float64), dim=0)


def points() -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    return 2.0 * torch.rand(400, 3, generator=generator, dtype=torch.float64) - 1.0


@pytest.mark.parametrize("softness", [0.0, 0.15])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_derivatives_agree_with_finite_differences(shape: SpotLight, softness: float) -> None:
    """Median over the points, as a linear rim has kinks; float32 differences, so the step is not small."""
    step, where = 1e-3, points()
    light = shape.at(POSITION, AXIS)
    relative = light.relative_intensity(where, softness=softness, shape_free=True)
    assert float(relative.value.min()) >= 0.0 and float((relative.by["cone_angle"].abs() > 0.1).float().mean()) > 0.02

    def value(name: str, change: torch.Tensor | float) -> torch.Tensor:
        return (
            replace(light, **{name: getattr(light, name) + change}).relative_intensity(where, softness=softness).value
        )

    pairs = []
    for shift in torch.eye(3, dtype=torch.float64):
        across = shift - (shift @ AXIS) * AXIS
        pairs.append((relative.by["position"] @ shift.float(), "position", shift))
        pairs.append((relative.by["direction"] @ across.float(), "direction", across))
    pairs += [(relative.by[name], name, 1.0) for name in ("cone_angle", "falloff")]
    for slope, name, along in pairs:
        expected = (value(name, step * along) - value(name, -step * along)).double() / (2.0 * step)
        error = (slope - expected).abs().quantile(0.95) / expected.abs().max()
        # Measured at most 1.1e-4.
        assert float(error) < 1e-3


@pytest.mark.parametrize("softness", [0.0, 0.15])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_a_shape_that_is_known_changes_nothing_else(shape: SpotLight, softness: float) -> None:
    light = shape.at(POSITION, AXIS)
    free, known = (light.relative_intensity(points(), softness=softness, shape_free=both) for both in (True, False))
    assert {*free.by} - {*known.by} == {"cone_angle", "falloff"}
    for name, value in tensors(known).items():
        # Measured: no difference. One cone for all points may round otherwise elsewhere.
        torch.testing.assert_close(value, tensors(free)[name], rtol=0.0, atol=2e-6)


def tensors(relative: RelativeIntensity) -> dict[str, torch.Tensor]:
    return {"value": relative.value, **relative.by}


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.profile)
def test_the_length_of_an_axis_does_not_matter(shape: SpotLight) -> None:
    """To the relative intensity; its derivative towards the axis falls with it."""
    one, two = (shape.at(POSITION, length * AXIS).relative_intensity(points()) for length in (1.0, 2.0))
    # Measured 0.
    torch.testing.assert_close(two.value, one.value, rtol=0.0, atol=1e-6)
    torch.testing.assert_close(2.0 * two.by["direction"], one.by["direction"], rtol=1e-5, atol=1e-6)


def test_a_hard_edge_has_finite_derivatives() -> None:
    relative = SpotLight.shaped("smoothstep", 0.7, 0.0).at(POSITION, AXIS).relative_intensity(points(), shape_free=True)
    assert set(relative.value.tolist()) == {0.0, 1.0} and torch.isfinite(relative.by["cone_angle"]).all()
