"""Patch transport: all bounces between surfels through a small, precomputed inverse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.radiosity import LARGEST_ALBEDO
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.surfels import Surfels


@dataclass(frozen=True)
class PatchTransport:
    """Bounces between surfels, with the light between bounces averaged over patches.

    With radiosity B, direct part D and albedo ρ, per colour channel:

        B = D + ρ · F_p · H · R · D,     H = Σ_{k<b} M^k = (I − M)⁻¹ (I − M^b),     M = R ρ F_p

    where R (P, N) averages over patches by area, F_p (N, P) gathers from patches and b is the number of bounces;
    for all of them M^b is zero.

    Of a spot as bright as that of a lamp near a wall few rays of F_p know; see `renderer.bright_spots`.

    Attributes:
        average: R.
        gather: F_p.
        inverse: (3, P, P) H, one per channel.
        albedo: (N, 3) ρ.
        bounces: b; None for all.
    """

    average: SparseOperator
    gather: SparseOperator
    inverse: Tensor
    albedo: Tensor
    bounces: int | None = None

    def to(self, device: torch.device | str) -> PatchTransport:
        """The same transport on another device."""
        moved = (part.to(device) for part in (self.average, self.gather, self.inverse, self.albedo))
        return PatchTransport(*moved, self.bounces)

    def gathered(self, direct: Tensor) -> Tensor:
        """(N, 3, K) mean radiance that each surfel receives from the others, F_p H R D, over all bounces.

        Args:
            direct: (N, 3, K) direct radiosity D of K lightings.
        """
        count, channels, lightings = direct.shape
        flat = direct.reshape(count, channels * lightings)
        patches = (self.average @ flat).reshape(self.average.shape[0], channels, lightings)
        # A product a channel: with one lighting, seven times as fast as one batched product.
        solved = torch.stack([inverse @ patches[:, c] for c, inverse in enumerate(self.inverse)], dim=1)
        return (self.gather @ solved.reshape(-1, channels * lightings)).reshape(count, channels, lightings)

    def gathered_transposed(self, received: Tensor) -> Tensor:
        """(N, 3, K) the transpose of `gathered` applied to (N, 3, K): Rᵀ Hᵀ F_pᵀ."""
        count, channels, lightings = received.shape
        patches = self.gather.transposed @ received.reshape(count, channels * lightings)
        patches = patches.reshape(-1, channels, lightings)
        solved = torch.stack([inverse.T @ patches[:, c] for c, inverse in enumerate(self.inverse)], dim=1)
        flat = self.average.transposed @ solved.reshape(-1, channels * lightings)
        return flat.reshape(count, channels, lightings)

    def indirect(self, direct: Tensor) -> Tensor:
        """(N, 3, K) indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        return self.albedo[:, :, None] * self.gathered(direct)


def clustered_transport(
    gather: SparseOperator, surfels: Surfels, areas: Tensor, patches: int, *, seed: int
) -> PatchTransport:
    """Patch transport of surfels that are gathered into up to so many patches; into one where no light bounces.

    Args:
        gather, areas: as of `build_patch_transport`.
        surfels: N, their centres in double precision.
        seed: of the patches.
    """
    count = patches if gather.entries else 1
    labels = cluster_patches(surfels.centers, surfels.normals, count, seed=seed)
    return build_patch_transport(gather, labels, areas, surfels.albedo)


def build_patch_transport(
    gather: SparseOperator, labels: np.ndarray, areas: Tensor, albedo: Tensor, bounces: int | None = None
) -> PatchTransport:
    """Patch transport from the full gather operator.

    Args:
        gather: (N, N) F.
        labels: (N,) patch of each surfel, 0 … P−1, every patch with at least one surfel.
        areas: (N,) surface of each surfel, for the averages.
        albedo: (N, 3).
        bounces: how many; all if None.
    """
    count, patches = len(labels), int(labels.max(initial=-1)) + 1
    weights = np.maximum(areas.double().cpu().numpy(), 1e-12)
    total = np.bincount(labels, weights, patches)
    average = scipy.sparse.csr_matrix((weights / total[labels], (labels, np.arange(count))), shape=(patches, count))
    membership = scipy.sparse.csr_matrix((np.ones(count, np.float32), (np.arange(count), labels)), (count, patches))
    gathered = gather.to_scipy() @ membership
    device = albedo.device
    return PatchTransport(
        SparseOperator.from_scipy(average, device),
        SparseOperator.from_scipy(gathered, device),
        _bounce_operator(average, gathered, albedo, bounces),
        albedo.float(),
        bounces,
    )


def with_albedo(transport: PatchTransport, albedo: Tensor) -> PatchTransport:
    """The same geometry with other materials: only H is made again."""
    return _remade(transport, albedo, transport.bounces)


def with_bounces(transport: PatchTransport, bounces: int | None) -> PatchTransport:
    """The same scene with another number of bounces (all if None): only H is made again."""
    return _remade(transport, transport.albedo, bounces)


def _remade(transport: PatchTransport, albedo: Tensor, bounces: int | None) -> PatchTransport:
    average, gathered = transport.average.to_scipy(), transport.gather.to_scipy()
    inverse = _bounce_operator(average, gathered, albedo, bounces)
    return PatchTransport(transport.average, transport.gather, inverse, albedo.float(), bounces)


def _bounce_operator(
    average: scipy.sparse.csr_matrix, gathered: scipy.sparse.csr_matrix, albedo: Tensor, bounces: int | None
) -> Tensor:
    """(3, P, P) float32 H of every channel, worked out in float64."""
    rho = albedo.double().clamp(0.0, LARGEST_ALBEDO).cpu().numpy()
    gathered = gathered.astype(np.float64)
    steps = [(average @ scipy.sparse.diags(rho[:, c]) @ gathered).toarray() for c in range(3)]
    bounce, identity = np.stack(steps), np.eye(average.shape[0])
    # Not torch's, which fails or hangs for stacks of such matrices where its number of threads was set (MKL).
    result = np.linalg.inv(identity - bounce)
    if bounces is not None:
        result = result @ (identity - np.linalg.matrix_power(bounce, bounces))
    return torch.from_numpy(result).float().to(albedo.device)
