"""Patch transport and the full solves: they agree, their backward is the transposed solve, and energy never grows."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from torch import Tensor

from rgspipe.names import Solver
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.radiosity import GatherSolver, solve_radiosity, solve_radiosity_directly
from rgspipe.renderer.transport import build_patch_transport, with_albedo, with_bounces
from rooms import closed_box


@pytest.fixture(scope="module")
def box() -> FrozenScene:
    return FrozenScene.freeze(closed_box(1 / 16, albedo=0.5), gather_rays=128, patches=200, seed=0)


@pytest.fixture(scope="module")
def albedo(box: FrozenScene) -> Tensor:
    return 0.95 * torch.rand(len(box.surfels), 3, generator=torch.Generator().manual_seed(0))


@pytest.fixture(scope="module")
def direct(box: FrozenScene) -> Tensor:
    """(N, 3) direct radiosity of a lamp, the same in all channels."""
    irradiance, _ = box.unit_irradiance(torch.tensor([[0.1, -0.2, 0.2]]))
    return (0.5 / math.pi * irradiance.T).expand(-1, 3).contiguous()


def relative_error(found: Tensor, expected: Tensor) -> float:
    return float((found.double() - expected.double()).norm() / expected.double().norm())


#: A room of several hundred patches, made after torch was told its number of threads.
THREADS_SET = """
import torch
torch.set_num_threads(2)
from rgspipe.renderer.frozen import FrozenScene
from rooms import closed_box
frozen = FrozenScene.freeze(closed_box(1 / 16, albedo=0.5), gather_rays=16, patches=400, seed=0)
assert frozen.transport.inverse.isfinite().all()
"""


def test_scenes_freeze_where_the_number_of_threads_was_set() -> None:
    # In a process of its own, as nothing else shall run with that.
    subprocess.run([sys.executable, "-c", THREADS_SET], check=True, timeout=120, cwd=Path(__file__).parents[1])


def test_direct_and_iterative_solves_agree(box: FrozenScene, albedo: Tensor, direct: Tensor) -> None:
    exact = solve_radiosity_directly(box.gather, albedo, direct)
    # Measured 1.7e-7: float32 products.
    assert relative_error(solve_radiosity(box.gather, albedo, direct, tolerance=1e-7), exact) < 3e-6


def test_patches_are_within_a_percent_of_the_full_solve(box: FrozenScene, direct: Tensor) -> None:
    exact = solve_radiosity_directly(box.gather, box.surfels.albedo, direct)
    total = direct + box.transport.indirect(direct[..., None])[..., 0]
    # Measured 0.8 % with 200 patches of 8 surfels.
    assert relative_error(total, exact) < 0.01


def test_a_patch_for_every_surfel_is_the_full_solve(box: FrozenScene, albedo: Tensor, direct: Tensor) -> None:
    labels = torch.arange(len(box.surfels)).numpy()
    transport = build_patch_transport(box.gather, labels, box.areas, albedo)
    exact = solve_radiosity_directly(box.gather, albedo, direct)
    # Measured 2e-7.
    assert relative_error(direct + transport.indirect(direct[..., None])[..., 0], exact) < 2e-6


@pytest.mark.parametrize("bounces", [0, 1, 2, 5, 40])
def test_bounces_of_patches_are_a_truncated_series(
    box: FrozenScene, albedo: Tensor, direct: Tensor, bounces: int
) -> None:
    transport = with_bounces(with_albedo(box.transport, albedo), bounces)
    patches, total = transport.average @ direct, torch.zeros_like(direct)
    for _ in range(bounces):
        gathered = albedo * (transport.gather @ patches)
        patches, total = transport.average @ gathered, total + gathered
    found = transport.indirect(direct[..., None])[..., 0]
    # Measured 3e-7.
    assert float((found - total).abs().max()) <= 4e-6 * float(direct.max())


@pytest.mark.parametrize("solver", ["patches", "gather"])
def test_the_error_falls_with_every_bounce(box: FrozenScene, direct: Tensor, solver: Solver) -> None:
    """What is left after b bounces is at most ρ^(b+1)/(1 − ρ) of the brightest direct radiosity."""
    whole = box.with_solver(solver).indirect(direct[..., None])
    for bounces in (0, 1, 2, 4, 8):
        left = (whole - box.with_solver(solver, bounces=bounces).indirect(direct[..., None])).abs().max()
        # Measured 0.18 to 0.29 of the bound.
        assert float(left) <= 0.5 ** (bounces + 1) / 0.5 * float(direct.max()) * (1.0 + 1e-4)


def test_all_bounces_come_back_after_few(box: FrozenScene) -> None:
    again = with_bounces(with_bounces(box.transport, 2), None)
    # Measured 1.5e-8.
    torch.testing.assert_close(again.inverse, box.transport.inverse, rtol=0, atol=1e-6)


@pytest.mark.parametrize("bounces", [None, 3])
def test_backward_is_the_transposed_solve(box: FrozenScene, albedo: Tensor, bounces: int | None) -> None:
    """⟨c, S d⟩ = ⟨Sᵀ c, d⟩, with the left side by the forward solve and the right by backward."""
    generator = torch.Generator().manual_seed(0)
    source, cotangent = (torch.rand(len(box.surfels), 3, generator=generator) for _ in range(2))
    leaf = source.clone().requires_grad_()
    value = (solve_radiosity(box.gather, albedo, leaf, tolerance=1e-7, bounces=bounces) * cotangent).sum()
    value.backward()
    # Measured 3e-7.
    torch.testing.assert_close((leaf.grad * source).sum(), value.detach(), rtol=5e-6, atol=0)


def test_backward_by_transposed_solve_equals_autograd_through_the_unrolled_solve(
    box: FrozenScene, albedo: Tensor, direct: Tensor
) -> None:
    cotangent = torch.rand(direct.shape, generator=torch.Generator().manual_seed(1))
    solved, unrolled = direct.clone().requires_grad_(), direct.clone().requires_grad_()
    (solve_radiosity(box.gather, albedo, solved, tolerance=1e-7) * cotangent).sum().backward()
    total = bounce = unrolled
    for _ in range(100):
        bounce = albedo * (box.gather @ bounce)
        total = total + bounce
    (total * cotangent).sum().backward()
    # Measured 3e-7: 100 bounces of a mean albedo of a half leave nothing in float32.
    assert relative_error(solved.grad, unrolled.grad) < 3e-6


def test_patches_are_differentiable(box: FrozenScene, direct: Tensor) -> None:
    cotangent = torch.rand(len(box.surfels), 3, 1, generator=torch.Generator().manual_seed(1))
    leaf = direct[..., None].clone().requires_grad_()
    value = (box.transport.indirect(leaf) * cotangent).sum()
    value.backward()
    # Measured 2e-7.
    torch.testing.assert_close((leaf.grad * leaf.detach()).sum(), value.detach(), rtol=5e-6, atol=0)


def test_energy_never_grows(box: FrozenScene, albedo: Tensor) -> None:
    """Rows sum to at most 1, and the spectral radius of ρF, by power iteration, is below the largest albedo."""
    sums = box.gather.matrix @ torch.ones(len(box.surfels), 1)
    patch_sums = box.transport.gather.matrix @ torch.ones(box.transport.gather.shape[1], 1)
    # Measured 1 + 2e-6.
    assert float(sums.max()) <= 1.0 + 1e-5 and float(patch_sums.max()) <= 1.0 + 1e-5
    for rho in (albedo[:, :1], torch.full_like(albedo[:, :1], 0.99)):
        radius = spectral_radius(GatherSolver(box.gather, rho.expand(-1, 3), bounces=1))
        # Measured 0.48 for albedo uniform in [0, 0.95] and 0.990 for 0.99.
        assert radius <= float(rho.max()) * (1.0 + 1e-5)


def spectral_radius(one_bounce: GatherSolver) -> float:
    """Of a non-negative operator, so that the mean of a positive vector grows by the radius in the end."""
    x = torch.ones(one_bounce.gather.shape[0], 3, 1)
    for _ in range(50):
        bounced = one_bounce.indirect(x)
        growth = float(bounced.norm() / x.norm())
        x = bounced / bounced.norm()
    return growth


def test_solvers_are_chosen_by_name(box: FrozenScene, direct: Tensor) -> None:
    assert box.with_solver("patches").solver is box.transport
    patches, gather = (box.with_solver(name).indirect(direct[..., None]) for name in ("patches", "gather"))
    # Measured 1.7 % of the indirect part.
    assert 1e-4 < relative_error(patches, gather) < 0.05
    with pytest.raises(ValueError, match="patches, gather or monte_carlo"):
        box.with_solver("photons")
