"""Shaded rays against autograd of the float64 reference; the reference against finite differences."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from clouds import DEVICES, FAR, cloud, cloud_rays, moved, rays_down, thousand_faint_layers
from rgspipe.renderer import reference
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Surfels

GEOMETRY = ("centers", "rotations", "scales", "opacities", "clip_offsets", "clip_angles")


def gradients(surfels: Surfels, rays: tuple[Tensor, Tensor], kernel: bool) -> dict[str, Tensor]:
    """Gradients of a random linear function of colours and coverage, in the dtype and on the device of the surfels."""
    like = surfels.centers
    leaves = {name: getattr(surfels, name).clone().requires_grad_() for name in GEOMETRY}
    scene = replace(surfels, **leaves)
    thresholds = torch.tensor([surfels.coverage.low, surfels.coverage.high]).to(like).requires_grad_()
    generator = torch.Generator().manual_seed(4)
    radiance = torch.rand(2, len(surfels), 3, generator=generator, dtype=torch.float64)
    radiance = radiance.to(like.device, torch.float32 if kernel else torch.float64).requires_grad_()
    cotangent = torch.randn(len(rays[0]), 4, generator=generator, dtype=torch.float64).to(like.device)
    ray_view = torch.arange(len(rays[0]), device=like.device) % 2
    arguments = (scene, thresholds, radiance, rays[0].to(like.device), rays[1].to(like.device), ray_view)
    colours = shade_rays(SurfelBvh(scene), *arguments) if kernel else reference.shade_rays(*arguments)
    (colours.double() * cotangent).sum().backward()
    found = {name: leaf.grad for name, leaf in leaves.items()}
    # The length of a quaternion is free; only the part across it means anything.
    turn = surfels.rotations
    found["rotations"] = found["rotations"] - (found["rotations"] * turn).sum(dim=1, keepdim=True) * turn
    found |= {"thresholds": thresholds.grad, "radiance": radiance.grad}
    return {name: gradient.double().cpu() for name, gradient in found.items()}


def assert_near(found: dict[str, Tensor], expected: dict[str, Tensor], bound: float) -> None:
    for name, value in expected.items():
        if float(value.norm()) == 0.0:
            assert float(found[name].norm()) == 0.0, name
            continue
        error = float((found[name] - value).norm() / value.norm())
        assert error < bound, f"{name}: relative error {error:.1e}"


@pytest.mark.parametrize("device", DEVICES)
def test_gradients_match_autograd_of_the_reference(device: str) -> None:
    surfels, rays = cloud(200, seed=0), cloud_rays(400, seed=1)
    found = gradients(surfels.to(torch.float32).to(device), rays, kernel=True)
    # Measured 1.8e-6 (thresholds) to 1.6e-5 (centres): float32 decides α at the foot of a clip's ramp.
    assert_near(found, gradients(surfels, rays, kernel=False), 1e-4)


@pytest.mark.parametrize("device", DEVICES)
def test_gradients_reach_every_one_of_a_thousand_faint_layers(device: str) -> None:
    surfels, rays = thousand_faint_layers(), rays_down(4)
    expected = gradients(surfels, rays, kernel=False)
    assert bool((expected["opacities"] != 0).all()), "every layer must matter for this to prove anything"
    # Measured 1.0e-6 (scales) to 8.0e-6 (rotations).
    assert_near(gradients(surfels.to(torch.float32).to(device), rays, kernel=True), expected, 5e-5)


def test_gradients_far_from_the_origin_are_those_at_the_origin() -> None:
    surfels, (origins, directions) = cloud(200, seed=0), cloud_rays(400, seed=1)
    expected = gradients(surfels, (origins, directions), kernel=False)
    found = gradients(moved(surfels, FAR), (origins + FAR, directions), kernel=True)
    # Measured 3.3e-6 to 2.8e-5.
    assert_near(found, expected, 1e-4)


@pytest.mark.parametrize("name", [*GEOMETRY, "thresholds", "radiance"])
def test_the_reference_matches_finite_differences(name: str) -> None:
    """The composite's gradient is exact where no hit changes its layer: a random direction, few surfels."""
    surfels, (origins, directions) = cloud(12, seed=5), cloud_rays(60, seed=6)
    generator = torch.Generator().manual_seed(7)
    inputs = {key: getattr(surfels, key) for key in GEOMETRY}
    inputs["thresholds"] = torch.tensor([0.2, 0.9], dtype=torch.float64)
    inputs["radiance"] = torch.rand(1, 12, 3, generator=generator, dtype=torch.float64)
    direction = torch.randn(inputs[name].shape, generator=generator, dtype=torch.float64)

    def shaded(value: Tensor) -> Tensor:
        values = inputs | {name: value}
        scene = replace(surfels, **{key: values[key] for key in GEOMETRY})
        ray_view = torch.zeros(60)
        colours = reference.shade_rays(scene, values["thresholds"], values["radiance"], origins, directions, ray_view)
        return (colours * colours).sum()

    leaf = inputs[name].clone().requires_grad_()
    shaded(leaf).backward()
    step = 1e-6
    difference = (shaded(inputs[name] + step * direction) - shaded(inputs[name] - step * direction)) / (2 * step)
    # Measured up to 4e-8 relative.
    torch.testing.assert_close((leaf.grad * direction).sum(), difference, rtol=1e-6, atol=1e-8)
