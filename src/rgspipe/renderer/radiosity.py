"""The full light transport between surfels, without patches: by bounces, and directly for small scenes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from rgspipe.renderer.sparse import SparseOperator

#: Albedo above this counts as this in the bounces: a closed room that absorbs nothing never settles.
LARGEST_ALBEDO = 0.999


@dataclass(frozen=True)
class GatherSolver:
    """Indirect light through the full gather operator, bounce by bounce.

    Attributes:
        gather: (N, N) F.
        albedo: (N, 3) ρ.
        bounces: how many; None for as many as `tolerance` needs.
        tolerance: relative error at which bounces end, in the largest value.
    """

    gather: SparseOperator
    albedo: Tensor
    bounces: int | None = None
    tolerance: float = 1e-4

    def to(self, device: torch.device | str) -> GatherSolver:
        """The same on another device."""
        return GatherSolver(self.gather.to(device), self.albedo.to(device), self.bounces, self.tolerance)

    def indirect(self, direct: Tensor) -> Tensor:
        """(N, 3, K) indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        count, _, lightings = direct.shape
        albedo = self.albedo[:, :, None].expand_as(direct).reshape(count, 3 * lightings)
        flat = direct.reshape(count, 3 * lightings)
        total = solve_radiosity(self.gather, albedo, flat, self.tolerance, self.bounces)
        return (total - flat).reshape_as(direct)


class _Solve(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, gather: SparseOperator, albedo: Tensor, source: Tensor, tolerance: float, bounces: int | None
    ) -> Tensor:
        ctx.gather, ctx.albedo, ctx.ends = gather, albedo, (tolerance, bounces)
        return _neumann(lambda x: albedo * (gather.matrix @ x), source, albedo, *ctx.ends)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, None, Tensor, None, None]:
        albedo, transposed = ctx.albedo, ctx.gather.transposed
        step = lambda x: transposed @ (albedo * x)  # noqa: E731 - the operator, named where it is used
        return None, None, _neumann(step, gradient.contiguous(), albedo, *ctx.ends), None, None


def _neumann(
    step: Callable[[Tensor], Tensor], source: Tensor, albedo: Tensor, tolerance: float, bounces: int | None
) -> Tensor:
    """x = source + step(x): `bounces` of them, or else bounces are added until the next ones cannot matter.

    Every bounce keeps at most the largest albedo, so the bounces needed are known beforehand.
    """
    if source.numel() == 0:
        return source
    largest = float(albedo.max())
    most = max(2, math.ceil(math.log(tolerance) / math.log(largest))) if largest > 0 else 1
    total, bounce = source, source
    bound = tolerance * source.abs().amax()
    for _ in range(most if bounces is None else bounces):
        bounce = step(bounce)
        total = total + bounce
        if bounces is None and bool(bounce.abs().amax() <= bound * (1.0 - largest)):
            break
    return total


def solve_radiosity(
    gather: SparseOperator, albedo: Tensor, direct: Tensor, tolerance: float = 1e-4, bounces: int | None = None
) -> Tensor:
    """(N, C) radiosity B = D + ρ F B by bounces, differentiable towards D by the transposed solve.

    Args:
        gather: (N, N) F with row sums of at most 1.
        albedo: (N, C) or (N, 1), in [0, 1]; counts as at most LARGEST_ALBEDO.
        direct: (N, C) D.
        tolerance: relative error at which bounces end, in the largest value.
        bounces: exactly so many, whatever the tolerance; None for as many as it needs.
    """
    return _Solve.apply(gather, albedo.clamp(0.0, LARGEST_ALBEDO).contiguous(), direct, tolerance, bounces)


def solve_radiosity_directly(gather: SparseOperator, albedo: Tensor, direct: Tensor) -> Tensor:
    """(N, C) radiosity B = (I − ρF)⁻¹ D by elimination in float64: what the other solvers are held against.

    Differentiable towards D. Takes N² memory and N³ time, so it is for scenes of a few thousand surfels.

    Args:
        gather, albedo, direct: as for `solve_radiosity`.
    """
    dense = gather.matrix.to_dense().double()
    rho = albedo.double().clamp(0.0, LARGEST_ALBEDO).expand(direct.shape)
    identity = torch.eye(len(dense), dtype=torch.float64, device=dense.device)
    columns = [
        torch.linalg.solve(identity - rho[:, c, None] * dense, direct[:, c].double()) for c in range(direct.shape[1])
    ]
    return torch.stack(columns, dim=1)
