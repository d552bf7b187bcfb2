"""How far apart surfels stand, and the coverage that goes with it: for scenes that bring none."""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.scene.surfels import Coverage

#: Neighbours looked at, and how many of those on the same surface stand for the spacing.
LOOKED_AT, USED = 24, 4

#: Neighbours on the same surface: the least cosine of the normals, either way round, and the largest height over the
#: tangent plane as a share of the distance.
LIKE_COSINE, FLAT_SHARE = 0.8, 0.5

#: Surfels whose neighbours are looked at; of more, this many evenly through their order stand for all. The median of a
#: sample of n is off by about 1.25·σ/√n, below 1 % of the spacing.
SAMPLED = 20000

#: Width of the ramp at a clip in spacings, as initialisation makes it.
CLIP_SOFTNESS = 0.12


def surfel_spacing(centers: Tensor, normals: Tensor) -> float:
    """Median over the surfels of the mean distance to the nearest four on the same surface, scene units.

    Its cost is that of one tree over all of them.

    Args:
        centers: (N, 3).
        normals: (N, 3) unit vectors; their signs do not matter.

    Raises:
        ValueError: fewer than two different places, or none on the same surface as another.
    """
    points, normals_ = centers.double().numpy(), normals.double().numpy()
    count = min(LOOKED_AT + 1, len(points))
    if count < 2:
        raise ValueError("spacing needs at least two surfels")
    chosen = np.unique(np.linspace(0, len(points) - 1, SAMPLED).astype(int)) if len(points) > SAMPLED else slice(None)
    own, axis = points[chosen], normals_[chosen, None]
    distance, index = cKDTree(points).query(own, k=count, workers=-1)
    distance, index = distance[:, 1:], index[:, 1:]
    offset = points[index] - own[:, None]
    like = np.abs((normals_[index] * axis).sum(axis=-1)) > LIKE_COSINE
    flat = np.abs((offset * axis).sum(axis=-1)) <= FLAT_SHARE * distance
    nearest = np.sort(np.where(like & flat & (distance > 0), distance, np.inf), axis=1)[:, :USED]
    found = np.isfinite(nearest)
    if not found.any():
        raise ValueError("spacing needs surfels that lie on one surface")
    mean = np.where(found, nearest, 0.0).sum(axis=1)[found.any(axis=1)] / found.sum(axis=1)[found.any(axis=1)]
    return float(np.median(mean))


def inferred_coverage(
    centers: Tensor, normals: Tensor, scales: Tensor, *, low: float, high: float, layer: float, minimum_alpha: float
) -> Coverage:
    """A coverage for surfels that bring none.

    Args:
        scales: (N, 2) standard deviations.
        low, high, minimum_alpha: as in Coverage.
        layer: thickness of a layer in units of the median scale: how far surfels of one surface may stand off it.

    Raises:
        ValueError: as `surfel_spacing`, and thresholds that Coverage refuses.
    """
    scale = float(scales.double().log().mean(dim=1).median().exp())
    softness = CLIP_SOFTNESS * surfel_spacing(centers, normals)
    return Coverage(low, high, layer * scale, softness, minimum_alpha)


def bounding_center(centers: Tensor) -> Tensor:
    """(3,) the middle of the central 98 % of the centres along each axis, so that strays do not pull it."""
    share = torch.tensor([0.01, 0.99], dtype=torch.float64)
    return torch.from_numpy(np.quantile(centers.double().numpy(), share.numpy(), axis=0).mean(axis=0))
