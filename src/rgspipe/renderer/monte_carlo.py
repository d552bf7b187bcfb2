"""Indirect light by Monte Carlo: what the published method does in every step, for comparison."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.gather import LIFT, RAYS_AT_ONCE
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.point_sets import cosine_directions
from rgspipe.renderer.radiosity import LARGEST_ALBEDO
from rgspipe.renderer.rays import normalised_weights, rows_from_hits
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.view_weights import nearest_hit


@dataclass(frozen=True)
class MonteCarloSolver:
    """Indirect light from fresh random hemisphere rays at every evaluation.

    After one direct pass every bounce is gathered by independent estimates F_k of the gather operator:

        B = D + ρF_1 (D + ρF_2 (D + … ρF_b D)),     E[F_k] = F

    As the estimates are independent the mean of their products is the product of their means, so B is an unbiased
    estimate of b bounces under the coverage of the scene. The gradient towards D is the transposed product of the
    same F_k, so it is unbiased, too. The rays are independent and uniform, as in the published method, and not the
    even point sets of the precomputed gather: the error falls with 1/√samples.

    Attributes:
        bvh: the surfels' hierarchy.
        samples: rays a surfel and bounce.
        bounces: b.
        generator: of the rays; every evaluation moves it on.
    """

    bvh: SurfelBvh
    samples: int
    bounces: int
    generator: torch.Generator

    def __post_init__(self) -> None:
        if self.samples < 1 or self.bounces < 0:
            raise ValueError(f"Monte Carlo needs samples ≥ 1 and bounces ≥ 0, got {self.samples} and {self.bounces}")

    def to(self, device: torch.device | str) -> MonteCarloSolver:
        """The same on another device; rays are still drawn on the CPU."""
        return replace(self, bvh=SurfelBvh(self.bvh.surfels.to(device)))

    def indirect(self, direct: Tensor) -> Tensor:
        """(N, 3, K) estimate of the indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        albedo = self.bvh.surfels.albedo.to(direct).clamp(0.0, LARGEST_ALBEDO)[:, :, None]
        estimate = torch.zeros_like(direct)
        for _ in range(self.bounces):
            gathered = random_gather(self.bvh, self.samples, self.generator) @ (direct + estimate).flatten(1)
            estimate = albedo * gathered.reshape_as(direct)
        return estimate


def random_gather(bvh: SurfelBvh, samples: int, generator: torch.Generator) -> SparseOperator:
    """(N, N) unbiased estimate of the gather operator from `samples` independent cosine-distributed rays a surfel."""
    surfels, count = bvh.surfels, len(bvh.surfels)
    axes = surfels.frames.float()
    origins = surfels.centers + LIFT * surfels.scales.prod(dim=1).sqrt()[:, None] * axes[:, 2]
    per_batch = max(1, RAYS_AT_ONCE // samples)
    blocks = [scipy.sparse.csr_matrix((0, count), dtype=np.float32)]
    for start in range(0, count, per_batch):
        batch = slice(start, start + per_batch)
        directions = cosine_directions(axes[batch], samples, generator, "random")
        starts = origins[batch, None].expand_as(directions)
        hits = composite(bvh, starts.reshape(-1, 3), directions.reshape(-1, 3), nearest=nearest_hit(bvh))
        blocks.append(rows_from_hits(hits, normalised_weights(hits), samples, count))
    return SparseOperator.from_scipy(scipy.sparse.vstack(blocks, format="csr"), bvh.device)
