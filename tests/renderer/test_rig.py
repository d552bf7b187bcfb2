"""A rig of points and spots: values, every derivative, and that lights add up."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from rgspipe.renderer import reference
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.irradiance import SOFTENING
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rig import rig_irradiance, unit_response
from rgspipe.scene import PointLight, SpotLight, Surfels
from rgspipe.scene.lights import LightRig
from rgspipe.scene.lights.angles import angle_from_axis
from rooms import closed_box, rectangle, surfels_on

#: Every profile with a rim, one with a hard edge, one that is wider than a half-space, and point lights between them.
SHAPES = (
    PointLight.shaped(),
    SpotLight.shaped("gaussian", 0.4, 0.2),
    SpotLight.shaped("smoothstep", 0.7, 0.5),
    PointLight.shaped(),
    SpotLight.shaped("linear", 0.9, 0.3),
    SpotLight.shaped("smoothstep", 0.8, 0.0),
    SpotLight.shaped("gaussian", 2.0, 0.4),
    PointLight.shaped(),
)


def room() -> Surfels:
    """A closed box with a screen in its middle that casts shadows on all sides: 166 surfels."""
    walls, (points, normals) = closed_box(1 / 5), rectangle([-0.2, -0.2, -0.1], [0.4, 0, 0], [0, 0.3, 0.2], 0.1)
    screen = surfels_on(points, normals, 0.1)
    joined = {name: torch.cat([tensor, screen.tensors()[name]]) for name, tensor in walls.tensors().items()}
    return replace(walls, **joined)


def parameters() -> dict[str, Tensor]:
    """Positions in the room, log-intensities around 0 and axes of several lengths, float64."""
    generator = torch.Generator().manual_seed(3)
    count = len(SHAPES)
    return {
        "positions": 0.7 * (torch.rand(count, 3, generator=generator, dtype=torch.float64) - 0.5),
        "log_intensities": torch.randn(count, 3, generator=generator, dtype=torch.float64),
        "axes": torch.randn(count, 3, generator=generator, dtype=torch.float64),
    }


def rig(positions: Tensor, log_intensities: Tensor, axes: Tensor) -> LightRig:
    tensors = zip(positions, axes, log_intensities.exp(), strict=True)
    return tuple(shape.at(*each) for shape, each in zip(SHAPES, tensors, strict=True))


def expected_irradiance(
    surfels: Surfels, positions: Tensor, log_intensities: Tensor, axes: Tensor, shapes=SHAPES
) -> Tensor:
    """(N, 3) by the references, in float64."""
    towards = surfels.centers - positions[:, None]
    cosine = -(towards * surfels.normals).sum(dim=-1).clamp(max=0.0)
    softening = (float(SOFTENING) * surfels.scales.prod(dim=1).sqrt()).pow(4)
    geometry = cosine / (towards.square().sum(dim=-1).square() + softening).pow(0.75)
    point = geometry * reference.transmittance(surfels, positions)
    relative = [
        torch.ones_like(row) if shape.axis is None else shape.relative_intensity_at(angle_from_axis(axis, v))
        for shape, axis, v, row in zip(shapes, axes, towards, point, strict=True)
    ]
    return (torch.stack(relative) * point).T @ log_intensities.exp()


@pytest.fixture(scope="module")
def surfels() -> Surfels:
    return room()


@pytest.fixture(scope="module")
def bvh(surfels: Surfels) -> SurfelBvh:
    return SurfelBvh(surfels.to(torch.float32))


@pytest.fixture(scope="module")
def frozen(surfels: Surfels) -> FrozenScene:
    return FrozenScene.freeze(surfels, gather_rays=32, patches=60, seed=0)


def test_irradiance_of_a_mixed_rig_matches_the_references(surfels: Surfels, bvh: SurfelBvh) -> None:
    values = parameters()
    expected, found = expected_irradiance(surfels, **values), rig_irradiance(bvh, rig(**values)).double()
    shaded, lit = (unit_response(bvh, rig(**values), Effects(shadows=on)).irradiance for on in (True, False))
    partly = shaded / lit
    assert float(((partly > 0.01) & (partly < 0.99)).float().mean()) > 0.02, "penumbrae prove the shadows"
    # Measured 2.3e-7.
    assert float((found - expected).abs().amax() / expected.amax()) < 5e-6


@pytest.mark.parametrize("name", ["positions", "log_intensities", "axes"])
def test_every_derivative_matches_finite_differences(surfels: Surfels, bvh: SurfelBvh, name: str) -> None:
    """Analytic derivatives in float32 against central differences of the float64 references, rims and shadows in."""
    values = parameters()
    generator = torch.Generator().manual_seed(4)
    cotangent = torch.rand(len(surfels), 3, generator=generator, dtype=torch.float64)
    leaf = values[name].clone().requires_grad_()
    (rig_irradiance(bvh, rig(**(values | {name: leaf}))) * cotangent).sum().backward()
    step, expected = 1e-6, torch.zeros_like(leaf.grad)
    for light, shape in enumerate(SHAPES):
        alone = {key: value[light : light + 1] for key, value in values.items()}
        for component in range(3):
            shift = step * torch.eye(3, dtype=torch.float64)[component]
            ahead, behind = (
                expected_irradiance(surfels, **(alone | {name: alone[name] + sign * shift}), shapes=(shape,))
                for sign in (1.0, -1.0)
            )
            expected[light, component] = ((ahead - behind) * cotangent).sum() / (2.0 * step)
    error = (leaf.grad - expected).norm(dim=1) / expected.norm(dim=1).clamp(min=1e-3 * float(expected.norm()))
    # Measured up to 2e-6 (positions), 4e-7 (log-intensities) and 7e-7 (axes).
    assert float(error.amax()) < 2e-5


def test_axes_of_point_lights_do_nothing(bvh: SurfelBvh) -> None:
    values = parameters()
    axes = values["axes"].clone().requires_grad_()
    rig_irradiance(bvh, rig(**(values | {"axes": axes}))).sum().backward()
    points = torch.tensor([shape.axis is None for shape in SHAPES])
    assert bool((axes.grad[points] == 0).all())
    assert bool((axes.grad[~points].abs().amax(dim=1) > 0).any())


def test_a_rig_without_spots_pays_for_no_profile(bvh: SurfelBvh, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a point light has no profile")

    monkeypatch.setattr("rgspipe.scene.lights.axial.angle_slopes", refuse)
    lamps = tuple(PointLight(p, torch.ones(3).double()) for p in parameters()["positions"])
    assert all(slopes.shape[1] == 3 for slopes in unit_response(bvh, lamps).slopes)
    assert rig_irradiance(bvh, lamps).shape == (len(bvh.surfels), 3)


def test_only_a_shape_that_moves_pays_for_its_derivatives(bvh: SurfelBvh) -> None:
    spot = SHAPES[1]
    moving = replace(spot, cone_angle=torch.tensor(spot.cone_angle, requires_grad=True))
    known, free = unit_response(bvh, (spot, moving)).slopes
    assert (known.shape[1], free.shape[1]) == (3, 4)


def test_eight_mixed_lights_are_the_sum_of_each(frozen: FrozenScene) -> None:
    lights = rig(**parameters())
    assert {type(light) for light in lights} == {PointLight, SpotLight}
    together = frozen.radiance_of(lights)
    alone = torch.stack([frozen.radiance_of((light,)) for light in lights]).sum(dim=0)
    # Measured 2e-7 of the largest: float32 sums in another order.
    assert float((together - alone).abs().amax() / together.amax()) < 2e-6


def test_radiance_is_linear_in_intensity(frozen: FrozenScene) -> None:
    once = rig(**parameters())
    twice = tuple(replace(light, intensity=2.0 * light.intensity) for light in once)
    torch.testing.assert_close(frozen.radiance_of(twice), 2.0 * frozen.radiance_of(once), rtol=0, atol=0)


def test_gradients_reach_the_tensors_of_the_lights(frozen: FrozenScene) -> None:
    position, axis = (torch.tensor(x, requires_grad=True) for x in ([0.1, 0.2, 0.2], [0.1, -0.3, -1.0]))
    intensity = torch.ones(3, requires_grad=True)
    light = SpotLight(position, intensity, axis, "gaussian", 0.5, 0.2)
    frozen.radiance_of((light, PointLight(torch.zeros(3), torch.ones(3)))).sum().backward()
    for leaf in (position, axis, intensity):
        assert bool(torch.isfinite(leaf.grad).all()) and float(leaf.grad.norm()) > 0
    # The axis' length does not matter. Measured 4e-8.
    assert abs(float(axis.grad @ axis.detach())) < 1e-5 * float(axis.grad.norm() * axis.detach().norm())


def test_a_rig_without_lights_is_dark(frozen: FrozenScene) -> None:
    assert float(frozen.radiance_of(()).abs().max()) == 0.0
