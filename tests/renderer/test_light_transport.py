"""Light transport in closed form: inverse square, furnaces, areas, and the solvers against each other."""

from __future__ import annotations

import math

import pytest
import torch

from rgspipe.renderer import reference
from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.direct import differentiable_irradiance, unit_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.radiosity import solve_radiosity
from rgspipe.scene import PointLight
from rooms import closed_box, rectangle, sphere, surfels_on


@pytest.fixture(scope="module")
def box() -> FrozenScene:
    return FrozenScene.freeze(closed_box(1 / 16, albedo=0.5), gather_rays=128, patches=200, seed=0)


def test_inverse_square_and_cosine() -> None:
    """E = cosθ/r² on a plane, for distances far above the softening."""
    points, normals = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0], 0.02)
    surfels = surfels_on(points, normals, 0.02).to(torch.float32)
    light = torch.tensor([[0.1, 0.2, 0.7]])
    irradiance, _ = unit_irradiance(SurfelBvh(surfels), light)
    d = light.double() - points
    expected = d[:, 2] / d.norm(dim=1) ** 3
    # Measured 4e-7: the softening ε = one scale takes ¾(ε/r)⁴.
    torch.testing.assert_close(irradiance[0].double(), expected, rtol=5e-6, atol=0)


def test_irradiance_derivative_matches_finite_differences() -> None:
    generator = torch.Generator().manual_seed(0)
    centers = torch.randn(50, 3, generator=generator, dtype=torch.float64)
    normals = torch.nn.functional.normalize(torch.randn(50, 3, generator=generator, dtype=torch.float64), dim=1)
    scales = torch.full((50,), 0.1, dtype=torch.float64)
    light = torch.tensor([[0.2, -0.1, 0.4]], dtype=torch.float64)
    _, slope = reference.geometry_factor(light, centers, normals, scales)
    step = 1e-6
    for axis in range(3):
        shift = torch.zeros(3, dtype=torch.float64)
        shift[axis] = step
        ahead, behind = (reference.geometry_factor(light + s * shift, centers, normals, scales)[0] for s in (1, -1))
        # Measured 1e-9.
        torch.testing.assert_close(slope[..., axis], (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-7)


def test_autograd_of_irradiance_is_its_derivative(box: FrozenScene) -> None:
    light = torch.tensor([[0.1, 0.2, 0.1]], requires_grad=True)
    weights = torch.rand(len(box.surfels), generator=torch.Generator().manual_seed(0))
    (differentiable_irradiance(box.bvh, light)[0] * weights).sum().backward()
    _, slope = box.unit_irradiance(light.detach())
    # Measured 3.8e-5: float32 sums of terms that cancel, in two orders.
    torch.testing.assert_close(light.grad[0], (slope[0] * weights[:, None]).sum(dim=0), rtol=2e-4, atol=0)


def test_areas_add_up_to_the_surface(box: FrozenScene) -> None:
    # Measured +3.8 % at 16 cells a side: footprints reach past the box's edges by a part of the spacing.
    assert float(box.areas.sum()) == pytest.approx(6.0, rel=0.08)
    inner = (box.surfels.centers.abs() < 0.4).sum(dim=1) == 2
    # One cell is 1/256; measured mean +1.1 %, spread 6 %.
    assert float(box.areas[inner].mean()) == pytest.approx(1 / 256, rel=0.02)


def test_gather_rows_are_shares_of_a_hemisphere(box: FrozenScene) -> None:
    rows = box.gather.matrix @ torch.ones(len(box.surfels), 1)
    assert float(rows.max()) <= 1.0 + 1e-5
    # Closed: all of the hemisphere is surface. Measured minimum 1.0000.
    assert float(rows.min()) > 0.99


@pytest.mark.parametrize("albedo", [0.1, 0.5, 0.9, 0.99])
def test_furnace_with_uniform_emission(box: FrozenScene, albedo: float) -> None:
    """B = E/(1 − ρ) in a closed box that emits uniformly."""
    ones = torch.ones(len(box.surfels), 1)
    radiosity = solve_radiosity(box.gather, albedo * ones, ones, tolerance=1e-5)
    # Measured 1.0000 for each.
    assert float(radiosity.mean()) * (1.0 - albedo) == pytest.approx(1.0, rel=2e-3)


def test_pbrt_furnace() -> None:
    """A unit sphere of albedo 0.5 around a point light of intensity π reflects radiance 1, half of it directly."""
    scene = FrozenScene.freeze(sphere(3000), gather_rays=128, patches=200, seed=0)
    light = PointLight(torch.zeros(3), torch.full((3,), math.pi))
    direct = scene.radiance_of((light,), indirect=False)
    total = scene.radiance_of((light,))
    # Measured 0.5000 and 1.0000.
    torch.testing.assert_close(direct, torch.full_like(direct, 0.5), rtol=1e-4, atol=0)
    torch.testing.assert_close(total, torch.full_like(total, 1.0), rtol=1e-3, atol=0)


def test_patch_transport_agrees_with_full_solve(box: FrozenScene) -> None:
    irradiance, _ = box.unit_irradiance(torch.tensor([[0.1, -0.2, 0.2]]))
    patches = box.radiance(irradiance.T)[:, 0, 0]
    albedo = box.surfels.albedo[:, :1]
    full = solve_radiosity(box.gather, albedo, albedo / math.pi * irradiance.T, tolerance=1e-6)[:, 0]
    # Measured 0.8 % with 200 patches of 8 surfels.
    assert float((patches - full).norm() / full.norm()) < 0.02


def test_solver_gradient_is_the_transposed_solve(box: FrozenScene) -> None:
    """⟨c, S d⟩ = ⟨Sᵀ c, d⟩, with the left side by the forward solve and the right by backward."""
    generator = torch.Generator().manual_seed(0)
    source, cotangent = (torch.rand(len(box.surfels), 2, generator=generator) for _ in range(2))
    albedo = torch.rand(len(box.surfels), 2, generator=generator)
    leaf = source.clone().requires_grad_()
    value = (solve_radiosity(box.gather, albedo, leaf, tolerance=1e-7) * cotangent).sum()
    value.backward()
    # Measured 3e-7.
    torch.testing.assert_close((leaf.grad * source).sum(), value.detach(), rtol=1e-4, atol=0)


def test_superposition_and_linearity(box: FrozenScene) -> None:
    a = PointLight(torch.tensor([0.1, 0.2, 0.1]), torch.tensor([1.0, 2.0, 3.0]))
    b = PointLight(torch.tensor([-0.2, 0.0, 0.3]), torch.tensor([0.5, 0.1, 0.2]))
    twice = PointLight(a.position, 2.0 * a.intensity)
    together = box.radiance_of((a, b))
    torch.testing.assert_close(together, box.radiance_of((a,)) + box.radiance_of((b,)), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(box.radiance_of((twice,)), 2.0 * box.radiance_of((a,)), rtol=1e-5, atol=1e-6)


def test_reciprocity_of_the_gather(box: FrozenScene) -> None:
    """A_i F_ij = A_j F_ji between groups of surfels, within the sampling noise."""
    left = (box.surfels.centers[:, 0] < -0.49).float()[:, None]
    top = (box.surfels.centers[:, 2] > 0.49).float()[:, None]
    there = float((box.areas[:, None] * left * (box.gather.matrix @ top)).sum())
    back = float((box.areas[:, None] * top * (box.gather.matrix @ left)).sum())
    # Form factor of perpendicular unit squares that share an edge: 0.20004. Measured 0.2067 and 0.2068: the
    # footprints at the edges make both walls a little too large.
    assert there == pytest.approx(back, rel=5e-3)
    assert there == pytest.approx(0.20004, rel=0.05)


def test_form_factor_of_parallel_squares(box: FrozenScene) -> None:
    """Opposite faces of a cube see each other with 0.19982 of their hemispheres."""
    floor = box.surfels.centers[:, 2] < -0.49
    ceiling = (box.surfels.centers[:, 2] > 0.49).float()[:, None]
    share = float((box.gather.matrix @ ceiling)[floor].mean())
    # Measured 0.2018: +1 %, as the ceiling's footprints reach past its edges.
    assert share == pytest.approx(0.19982, rel=0.02)


def test_gather_does_not_depend_on_batches_or_threads() -> None:
    bvh = SurfelBvh(closed_box(1 / 8).to(torch.float32))
    first, second = (build_gather(bvh, 64, seed=3) for _ in range(2))
    assert torch.equal(first.matrix.values(), second.matrix.values())


def test_shadow_of_a_screen() -> None:
    """Behind an opaque screen it is dark, beside it light; the penumbra is as wide as the surfels are soft."""
    floor, up = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0], 0.05)
    screen, down = rectangle([-0.5, -0.5, 0.5], [0, 1, 0], [1, 0, 0], 0.02)
    surfels = surfels_on(torch.cat([floor, screen]), torch.cat([up, down]), 0.03).to(torch.float32)
    irradiance, _ = unit_irradiance(SurfelBvh(surfels), torch.tensor([[0.0, 0.0, 2.0]]))
    lit, _ = unit_irradiance(SurfelBvh(surfels), torch.tensor([[0.0, 0.0, 2.0]]), shadows=False)
    share = (irradiance / lit)[0, : len(floor)]
    reach = floor[:, :2].abs().amax(dim=1)
    edge = 0.5 * 2.0 / 1.5  # the screen's half-width, projected from the light onto the floor
    assert float(share[reach < edge - 0.1].max()) < 1e-3
    assert float(share[reach > edge + 0.1].min()) > 1.0 - 1e-3


def test_areas_are_seeded() -> None:
    bvh = SurfelBvh(closed_box(1 / 8).to(torch.float32))
    assert torch.equal(surfel_areas(bvh, seed=1), surfel_areas(bvh, seed=1))
