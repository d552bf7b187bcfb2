"""Indirect light of a frozen scene: the full gather solve, and patch transport with a precomputed inverse."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.cluster.vq
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.sparse import SparseOperator

#: Albedo above this counts as this in the bounces: a closed room that absorbs nothing never settles.
LARGEST_ALBEDO = 0.999

#: Weight of a normal against a position [scene sizes] when surfels are clustered into patches.
NORMAL_WEIGHT = 0.5


@dataclass(frozen=True)
class PatchTransport:
    """All bounces between surfels, with the light between bounces averaged over patches.

    With radiosity B, direct part D and albedo ρ, per colour channel:

        B = D + ρ · F_p · H · R · D,     H = (I − R ρ F_p)⁻¹

    where R (P, N) averages over patches by area and F_p (N, P) gathers from patches.

    Attributes:
        average: R.
        gather: F_p.
        inverse: (3, P, P) H, one per channel.
        albedo: (N, 3) ρ.
    """

    average: SparseOperator
    gather: SparseOperator
    inverse: Tensor
    albedo: Tensor

    def gathered(self, direct: Tensor) -> Tensor:
        """(N, 3, K) mean radiance that each surfel receives from the others, F_p H R D, over all bounces.

        Args:
            direct: (N, 3, K) direct radiosity D of K lightings.
        """
        count, channels, lightings = direct.shape
        patches = (self.average @ direct.reshape(count, -1)).reshape(-1, channels, lightings)
        solved = torch.einsum("cpq,qck->pck", self.inverse, patches)
        return (self.gather @ solved.reshape(-1, channels * lightings)).reshape(count, channels, lightings)

    def indirect(self, direct: Tensor) -> Tensor:
        """(N, 3, K) indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        return self.albedo[:, :, None] * self.gathered(direct)


def build_patch_transport(gather: SparseOperator, labels: np.ndarray, areas: Tensor, albedo: Tensor) -> PatchTransport:
    """Patch transport from the full gather operator.

    Args:
        gather: (N, N) F.
        labels: (N,) patch of each surfel, 0 … P−1, every patch with at least one surfel.
        areas: (N,) surface of each surfel, for the averages.
        albedo: (N, 3).
    """
    count, patches = len(labels), int(labels.max()) + 1
    weights = np.maximum(areas.double().cpu().numpy(), 1e-12)
    member = scipy.sparse.csr_matrix((np.ones(count), (np.arange(count), labels)), shape=(count, patches))
    total = np.bincount(labels, weights, patches)
    average = scipy.sparse.csr_matrix((weights / total[labels], (labels, np.arange(count))), shape=(patches, count))
    gathered = (gather.to_scipy() @ member).tocsr()
    device = albedo.device
    return PatchTransport(
        SparseOperator.from_scipy(average, device),
        SparseOperator.from_scipy(gathered, device),
        _bounce_inverse(average, gathered, albedo),
        albedo.float(),
    )


def with_albedo(transport: PatchTransport, albedo: Tensor) -> PatchTransport:
    """The same geometry with other materials: only the inverse is made again."""
    average, gathered = transport.average.to_scipy(), transport.gather.to_scipy()
    inverse = _bounce_inverse(average, gathered, albedo)
    return PatchTransport(transport.average, transport.gather, inverse, albedo.float())


def _bounce_inverse(average: scipy.sparse.csr_matrix, gathered: scipy.sparse.csr_matrix, albedo: Tensor) -> Tensor:
    rho = albedo.double().clamp(0.0, LARGEST_ALBEDO).cpu().numpy()
    bounces = [(average @ scipy.sparse.diags(rho[:, c]) @ gathered).toarray() for c in range(3)]
    system = torch.eye(average.shape[0], dtype=torch.float64) - torch.from_numpy(np.stack(bounces))
    return torch.linalg.inv(system).float().to(albedo.device)


def cluster_patches(centers: Tensor, normals: Tensor, patches: int, *, seed: int) -> np.ndarray:
    """(N,) labels of compact clusters of surfels by position and normal; at most `patches`, none empty."""
    size = float((centers.amax(dim=0) - centers.amin(dim=0)).amax().clamp(min=1e-12))
    features = torch.cat([centers / size, NORMAL_WEIGHT * normals], dim=1).double().cpu().numpy()
    patches = min(patches, len(features))
    start = features[np.random.default_rng(seed).choice(len(features), patches, replace=False)]
    with warnings.catch_warnings():
        # A cluster that runs empty leaves a gap in the labels, which the last line closes.
        warnings.filterwarnings("ignore", message="One of the clusters is empty")
        _, labels = scipy.cluster.vq.kmeans2(features, start, iter=8, minit="matrix", missing="warn", seed=seed)
    return np.unique(labels, return_inverse=True)[1]


class _Solve(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, gather: SparseOperator, albedo: Tensor, source: Tensor, tolerance: float) -> Tensor:
        ctx.gather, ctx.albedo, ctx.tolerance = gather, albedo, tolerance
        return _neumann(lambda x: albedo * (gather.matrix @ x), source, albedo, tolerance)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, None, Tensor, None]:
        albedo, transposed = ctx.albedo, ctx.gather.transposed
        step = lambda x: transposed @ (albedo * x)  # noqa: E731 - the operator, named where it is used
        return None, None, _neumann(step, gradient.contiguous(), albedo, ctx.tolerance), None


def _neumann(step: Any, source: Tensor, albedo: Tensor, tolerance: float) -> Tensor:
    """x = source + step(x): bounces are added until the next ones cannot matter.

    Every bounce keeps at most the largest albedo, so the bounces needed are known beforehand.
    """
    largest = float(albedo.max())
    most = max(2, math.ceil(math.log(tolerance) / math.log(largest))) if largest > 0 else 1
    total, bounce = source, source
    bound = tolerance * source.abs().amax()
    for _ in range(most):
        bounce = step(bounce)
        total = total + bounce
        if bool(bounce.abs().amax() <= bound * (1.0 - largest)):
            break
    return total


def solve_radiosity(gather: SparseOperator, albedo: Tensor, direct: Tensor, tolerance: float = 1e-4) -> Tensor:
    """(N, C) radiosity B = D + ρ F B by bounces, differentiable towards D by the transposed solve.

    Args:
        gather: (N, N) F with row sums of at most 1.
        albedo: (N, C) or (N, 1), in [0, 1]; counts as at most LARGEST_ALBEDO.
        direct: (N, C) D.
        tolerance: relative error at which bounces end, in the largest value.
    """
    return _Solve.apply(gather, albedo.clamp(0.0, LARGEST_ALBEDO).contiguous(), direct, tolerance)
