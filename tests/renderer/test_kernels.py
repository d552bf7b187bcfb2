"""Every kernel against its float64 reference: values and all gradients; the references against finite differences."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from rgspipe.renderer import reference
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.irradiance import transmittance
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import NO_CLIP, Coverage, Surfels

GEOMETRY = ("centers", "rotations", "scales", "opacities", "clip_offsets", "clip_angles")


def random_surfels(count: int, seed: int) -> Surfels:
    """A cloud in the unit cube: anisotropic, half transparent, half of them clipped."""
    generator = torch.Generator().manual_seed(seed)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator, dtype=torch.float64)

    clipped = uniform(count, 2) < 0.5
    return Surfels(
        centers=uniform(count, 3) - 0.5,
        rotations=torch.nn.functional.normalize(uniform(count, 4) - 0.5, dim=1),
        scales=0.05 + 0.1 * uniform(count, 2),
        opacities=0.3 + 0.65 * uniform(count),
        albedo=uniform(count, 3),
        clip_offsets=torch.where(clipped, 0.05 * uniform(count, 2), torch.full((count, 2), NO_CLIP).double()),
        clip_angles=6.28 * uniform(count, 2),
        coverage=Coverage(low=0.2, high=0.9, layer_thickness=0.03, clip_softness=0.03),
    )


def random_rays(count: int, seed: int) -> tuple[Tensor, Tensor]:
    generator = torch.Generator().manual_seed(seed)
    origins = torch.nn.functional.normalize(torch.randn(count, 3, generator=generator, dtype=torch.float64), dim=1)
    aims = torch.rand(count, 3, generator=generator, dtype=torch.float64) - 0.5
    return 1.5 * origins, torch.nn.functional.normalize(aims - 1.5 * origins, dim=1)


def dense(indices: Tensor, weights: Tensor, columns: int) -> Tensor:
    matrix = torch.zeros(len(indices), columns, dtype=torch.float64)
    ray, column = (indices >= 0).nonzero(as_tuple=True)
    index = (ray, indices[ray, column].long())
    return matrix.index_put_(index, weights[ray, column].double(), accumulate=True)


@pytest.mark.parametrize("two_sided", [False, True])
def test_composite_weights_match_reference(two_sided: bool) -> None:
    surfels, rays = random_surfels(200, seed=0), random_rays(300, seed=1)
    hits = composite(SurfelBvh(surfels.to(torch.float32)), *rays, two_sided=two_sided)
    weights, passing = reference.composite_dense(surfels, *rays, two_sided=two_sided)
    # Measured 4.5e-6 and 1.2e-5 (two-sided): float32 in depth decides α near the edge of a footprint.
    torch.testing.assert_close(dense(hits.indices, hits.weights, 200), weights, atol=5e-5, rtol=0)
    torch.testing.assert_close(hits.transmittance.double(), passing, atol=5e-5, rtol=0)
    assert float(passing.min()) < 0.05, "the scene must hold opaque rays for this to prove anything"


def test_weights_sum_to_what_is_stopped() -> None:
    surfels, rays = random_surfels(200, seed=2), random_rays(300, seed=3)
    hits = composite(SurfelBvh(surfels.to(torch.float32)), *rays)
    # Measured 1.5e-7.
    torch.testing.assert_close(hits.weights.sum(dim=1), 1.0 - hits.transmittance, atol=2e-6, rtol=0)


def shade_gradients(kind: str, dtype: torch.dtype) -> dict[str, Tensor]:
    surfels, (origins, directions) = random_surfels(200, seed=0).to(dtype), random_rays(400, seed=1)
    origins, directions = origins.to(dtype), directions.to(dtype)
    leaves = {name: getattr(surfels, name).clone().requires_grad_() for name in GEOMETRY}
    surfels = replace(surfels, **leaves)
    thresholds = torch.tensor([0.2, 0.9], dtype=dtype, requires_grad=True)
    generator = torch.Generator().manual_seed(4)
    radiance = torch.rand(2, 200, 3, generator=generator, dtype=torch.float64).to(dtype).requires_grad_()
    cotangent = torch.randn(400, 3, generator=generator, dtype=torch.float64).to(dtype)
    ray_view = torch.arange(400) % 2
    if kind == "reference":
        colours = reference.shade_rays(surfels, thresholds, radiance, origins, directions, ray_view)
    else:
        bvh = SurfelBvh(surfels)
        colours = shade_rays(bvh, surfels, thresholds, radiance, origins, directions, ray_view)
    (colours * cotangent).sum().backward()
    found = {name: leaf.grad for name, leaf in leaves.items()}
    return found | {"thresholds": thresholds.grad, "radiance": radiance.grad}


def test_shade_gradients_match_autograd_of_reference() -> None:
    expected = shade_gradients("reference", torch.float64)
    found = shade_gradients("kernel", torch.float32)
    rotations = random_surfels(200, seed=0).rotations
    for name, value in expected.items():
        other = found[name].double()
        if name == "rotations":  # the length of a quaternion is free; only the part across it means anything
            value = value - (value * rotations).sum(dim=1, keepdim=True) * rotations
            other = other - (other * rotations).sum(dim=1, keepdim=True) * rotations
        error = float((other - value).norm() / value.norm())
        # Measured 0.9e-6 (thresholds) to 4.2e-6 (rotations).
        assert error < 3e-5, f"{name}: relative error {error:.1e}"


@pytest.mark.parametrize("name", [*GEOMETRY, "thresholds", "radiance"])
def test_reference_shading_matches_finite_differences(name: str) -> None:
    """The composite's gradient is exact where no hit changes its layer: a random direction, few surfels."""
    surfels, (origins, directions) = random_surfels(12, seed=5), random_rays(60, seed=6)
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


def test_transmittance_and_derivative_match_reference() -> None:
    surfels = random_surfels(200, seed=0)
    lights = torch.tensor([[0.1, 0.2, 0.3], [0.0, 0.0, 0.9], [-0.7, 0.3, -0.2]], dtype=torch.float64)
    shares, slopes = transmittance(SurfelBvh(surfels.to(torch.float32)), lights)
    leaf = lights.clone().requires_grad_()
    expected = reference.transmittance(surfels, leaf)
    # Measured 6.8e-7.
    torch.testing.assert_close(shares.double(), expected.detach(), atol=1e-5, rtol=0)
    partly = float(((shares > 0.01) & (shares < 0.99)).float().mean())
    assert partly > 0.1, "the lights must have penumbrae for this to prove anything"
    generator = torch.Generator().manual_seed(1)
    cotangent = torch.rand(expected.shape, generator=generator, dtype=torch.float64)
    (expected * cotangent).sum().backward()
    found = (slopes.double() * cotangent[..., None]).sum(dim=1)
    # Measured 2e-6 relative.
    torch.testing.assert_close(found, leaf.grad, rtol=1e-4, atol=1e-4)


def test_reference_transmittance_matches_finite_differences() -> None:
    surfels = random_surfels(40, seed=8)
    light = torch.tensor([[0.1, 0.2, 0.3]], dtype=torch.float64)
    assert torch.autograd.gradcheck(lambda x: reference.transmittance(surfels, x), light.requires_grad_(), atol=1e-5)
