"""Compact clusters of surfels, the patches that light is averaged over between bounces."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

#: Weight of a normal against a position [scene sizes].
NORMAL_WEIGHT = 0.5

#: Rounds of Lloyd's algorithm.
ROUNDS = 10

#: Surfels whose distances to all clusters are held at once; bounds the memory to about 16 MB for 500 clusters.
SURFELS_AT_ONCE = 8192


def cluster_patches(centers: Tensor, normals: Tensor, patches: int, *, seed: int) -> np.ndarray:
    """Compact clusters of surfels by position and normal: k-means (Lloyd 1982) from a random choice of surfels.

    Args:
        centers, normals: (N, 3).
        patches: clusters wanted, at least 1.
        seed: of the choice that the clusters start from.

    Returns:
        (N,) labels 0 … P−1 of P ≤ `patches` clusters, none of them empty.
    """
    if len(centers) == 0:
        return np.zeros(0, dtype=np.int32)
    features = _features(centers, normals)
    count = min(patches, len(features))
    start = np.random.default_rng(seed).choice(len(features), count, replace=False)
    means = features[torch.from_numpy(start)]
    labels = _nearest(features, means)
    for _ in range(ROUNDS - 1):
        means = _means(features, labels, means)
        labels = _nearest(features, means)
    # A cluster that ran empty left a gap in the labels.
    return np.unique(labels.numpy(), return_inverse=True)[1].astype(np.int32)


def _features(centers: Tensor, normals: Tensor) -> Tensor:
    """(N, 6) float32 positions over the scene's size, around its middle, and weighted normals, on the CPU."""
    centers = centers.detach().double().cpu()
    lower, upper = centers.amin(dim=0), centers.amax(dim=0)
    placed = (centers - 0.5 * (lower + upper)) / float((upper - lower).amax().clamp(min=1e-12))
    return torch.cat([placed.float(), NORMAL_WEIGHT * normals.detach().float().cpu()], dim=1)


def _nearest(features: Tensor, means: Tensor) -> Tensor:
    """(N,) index of the mean (P, 6) nearest to each row; |x|² is the same for all and left out."""
    offset = means.square().sum(dim=1)
    blocks = [torch.addmm(offset, x, means.T, alpha=-2.0).argmin(dim=1) for x in features.split(SURFELS_AT_ONCE)]
    return torch.cat(blocks)


def _means(features: Tensor, labels: Tensor, previous: Tensor) -> Tensor:
    """(P, 6) means of the members; a cluster without members stays where it was."""
    members = torch.bincount(labels, minlength=len(previous))
    # Sums in float64 by bincount: in one order, whatever the number of threads.
    columns = [np.bincount(labels.numpy(), column.numpy(), len(previous)) for column in features.T]
    means = torch.from_numpy(np.stack(columns, axis=1)) / members.clamp(min=1)[:, None]
    return torch.where(members[:, None] > 0, means.to(previous), previous)
