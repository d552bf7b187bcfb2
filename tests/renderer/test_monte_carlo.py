"""Monte Carlo bounces: their mean is the full solve, their error falls as it should, their gradient is unbiased."""

from __future__ import annotations

from itertools import pairwise

import pytest
import torch
from torch import Tensor

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.monte_carlo import MonteCarloSolver, random_gather
from rgspipe.renderer.radiosity import GatherSolver
from rgspipe.scene import PointLight
from rooms import closed_box, sphere

BOUNCES = 3


@pytest.fixture(scope="module")
def bvh() -> SurfelBvh:
    return SurfelBvh(closed_box(1 / 6, albedo=0.7).to(torch.float32))


@pytest.fixture(scope="module")
def exact(bvh: SurfelBvh) -> GatherSolver:
    """So many rays in even point sets that what is left of their noise is far below that of Monte Carlo."""
    return GatherSolver(build_gather(bvh, 4096, seed=1), bvh.surfels.albedo, bounces=BOUNCES)


@pytest.fixture(scope="module")
def direct(bvh: SurfelBvh) -> Tensor:
    return torch.rand(len(bvh.surfels), 3, 1, generator=torch.Generator().manual_seed(0)).pow(4)


def solver(bvh: SurfelBvh, samples: int, seed: int = 0, bounces: int = BOUNCES) -> MonteCarloSolver:
    return MonteCarloSolver(bvh, samples, bounces, torch.Generator().manual_seed(seed))


def relative_error(found: Tensor, expected: Tensor) -> float:
    return float((found - expected).norm() / expected.norm())


def test_the_mean_of_many_estimates_is_the_full_solve(bvh: SurfelBvh, exact: GatherSolver, direct: Tensor) -> None:
    expected, few = exact.indirect(direct), solver(bvh, samples=4)
    estimates = torch.stack([few.indirect(direct) for _ in range(200)])
    one, mean = relative_error(estimates[0], expected), relative_error(estimates.mean(dim=0), expected)
    # 200 independent, unbiased estimates leave 1/√200 = 0.071 of the error of one: measured 0.073.
    assert mean < 0.09 * one
    # Measured 1.001.
    assert float(estimates.mean() / expected.mean()) == pytest.approx(1.0, rel=2e-3)


def test_the_error_falls_with_the_root_of_the_samples(bvh: SurfelBvh, exact: GatherSolver, direct: Tensor) -> None:
    expected = exact.indirect(direct)
    errors = []
    for samples in (4, 16, 64, 256):
        estimates = solver(bvh, samples)
        errors.append(sum(relative_error(estimates.indirect(direct), expected) for _ in range(4)) / 4)
    ratios = [few / many for few, many in pairwise(errors)]
    # Four times the samples, half the error. Measured 2.01, 2.03 and 1.99.
    assert ratios == pytest.approx([2.0, 2.0, 2.0], rel=0.1)


def test_the_gradient_is_the_adjoint_of_the_same_samples(bvh: SurfelBvh, direct: Tensor) -> None:
    """⟨c, S d⟩ = ⟨Sᵀc, d⟩ for one draw of S."""
    cotangent = torch.rand(direct.shape, generator=torch.Generator().manual_seed(1))
    leaf = direct.clone().requires_grad_()
    value = (solver(bvh, samples=4).indirect(leaf) * cotangent).sum()
    value.backward()
    torch.testing.assert_close((leaf.grad * direct).sum(), value.detach(), rtol=1e-5, atol=0)


def test_the_gradient_is_unbiased(bvh: SurfelBvh, exact: GatherSolver, direct: Tensor) -> None:
    cotangent = torch.rand(direct.shape, generator=torch.Generator().manual_seed(1)).pow(4)
    leaf = direct.clone().requires_grad_()
    (exact.indirect(leaf) * cotangent).sum().backward()
    expected, few, found = leaf.grad.clone(), solver(bvh, samples=4), []
    for _ in range(200):
        leaf.grad = None
        (few.indirect(leaf) * cotangent).sum().backward()
        found.append(leaf.grad)
    one, mean = relative_error(found[0], expected), relative_error(torch.stack(found).mean(dim=0), expected)
    # As above, measured 0.069.
    assert mean < 0.09 * one


def test_every_evaluation_draws_fresh_rays_and_a_seed_repeats_them(bvh: SurfelBvh, direct: Tensor) -> None:
    first, again = solver(bvh, samples=4, seed=5), solver(bvh, samples=4, seed=5)
    one, two = first.indirect(direct), first.indirect(direct)
    assert not torch.equal(one, two)
    assert torch.equal(again.indirect(direct), one) and torch.equal(again.indirect(direct), two)


def test_rows_are_shares_of_a_hemisphere(bvh: SurfelBvh) -> None:
    rows = random_gather(bvh, 8, torch.Generator().manual_seed(0)).matrix @ torch.ones(len(bvh.surfels), 1)
    # Closed: every ray meets a surface. Measured 1 ± 2e-7.
    torch.testing.assert_close(rows, torch.ones_like(rows), rtol=2e-6, atol=0)


def test_no_bounces_is_direct_light_and_each_adds_some(bvh: SurfelBvh, direct: Tensor) -> None:
    energies = [float(solver(bvh, 16, bounces=b).indirect(direct).sum()) for b in (0, 1, 2)]
    assert energies[0] == 0.0 < energies[1] < energies[2]
    with pytest.raises(ValueError, match="samples"):
        solver(bvh, samples=0)


def test_a_frozen_scene_renders_with_it() -> None:
    """pbrt's furnace: bounce k adds 2^−(k+1) to the direct ½."""
    frozen = FrozenScene.freeze(sphere(400), gather_rays=16, patches=20, seed=0)
    light = (PointLight(torch.zeros(3), torch.full((3,), torch.pi)),)
    radiance = frozen.with_solver("monte_carlo", bounces=3, samples=4, seed=0).radiance_of(light)
    torch.testing.assert_close(radiance, torch.full_like(radiance, 0.9375), rtol=1e-3, atol=0)
