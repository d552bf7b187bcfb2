"""Surfels made from the truth: what training could reach at best with the same renderer and number of surfels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.evaluation.arrays import to_array
from rgspipe.evaluation.metrics import edge_mask
from rgspipe.renderer.kernels.irradiance import transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels
from rgspipe.training.initialise import initialise_surfels

#: Points whose albedo a surfel averages, how far off its normal theirs may be (cosine), and how many are looked at.
POINTS, ALIKE, CANDIDATES = 16, 0.8, 48

#: Pixels with less surface than this show nothing of which the light could be said to reach it.
LEAST_COVERAGE = 0.5


def surfels_from_passes(views: Sequence[View], count: int, *, seed: int) -> Surfels:
    """`count` surfels from true depth, normals and albedo: the start of training at the albedo it looks for.

    Raises:
        ValueError: no view has depth, normals and albedo.
        InputError: see `initialise_surfels`.
    """
    whole = [view for view in views if view.depth is not None and view.normal is not None and view.albedo is not None]
    if not whole:
        raise ValueError("the truth needs views with depth, normals and albedo, and none has all three")
    surfels = initialise_surfels(whole, count, seed=seed, normals="pass")
    return replace(surfels, albedo=project_albedo(surfels, whole))


def project_albedo(surfels: Surfels, views: Sequence[View]) -> Tensor:
    """(N, 3) float32 albedo of surfels from the albedo passes of `views` with depth and normals.

    The mean over the nearest pixels, as surface points with a like normal, with the weights of the surfel's footprint.
    Pixels at edges may mix surfaces and are left out.
    """
    points, normals, albedo = (np.concatenate(part) for part in zip(*map(_surface, views), strict=True))
    centers, own = to_array(surfels.centers), to_array(surfels.normals)
    distance, near = cKDTree(points).query(centers, k=min(CANDIDATES, len(points)), workers=-1)
    distance, near = distance.reshape(len(centers), -1), near.reshape(len(centers), -1)
    alike = (normals[near] * own[:, None]).sum(axis=-1) > ALIKE
    # Of the candidates only the nearest alike count; where none is alike, all are.
    alike |= ~alike.any(axis=1, keepdims=True)
    chosen = alike & (alike.cumsum(axis=1) <= POINTS)
    scale = np.maximum(to_array(surfels.scales).mean(axis=1), distance[:, 0])[:, None]
    weight = chosen * np.exp(-0.5 * np.square(distance / scale).clip(max=100.0))
    mean = (weight[..., None] * albedo[near]).sum(axis=1) / weight.sum(axis=1, keepdims=True)
    return torch.from_numpy(mean).float()


def transmittance_image(bvh: SurfelBvh, weights: ViewWeights, position: Tensor) -> np.ndarray:
    """(H, W) part of a light at `position` (3,) that reaches what each pixel sees; NaN where it sees too little."""
    passing = transmittance(bvh, position[None])[0][0]
    coverage = weights.coverage.to(passing.device)
    seen = (weights.operator @ passing[:, None])[:, 0] / coverage.clamp(min=LEAST_COVERAGE)
    image = torch.where(coverage < LEAST_COVERAGE, torch.full_like(seen, torch.nan), seen)
    return to_array(image.reshape(weights.camera.height, weights.camera.width))


def _surface(view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, normals and albedo (K, 3) of the pixels of a view that lie on one surface."""
    depth, normal = to_array(view.depth), to_array(view.normal)
    known = np.isfinite(depth) & (np.abs(normal).sum(axis=-1) > 0.0)
    keep = known & ~edge_mask(np.where(known, depth, 0.0), normal)
    origins, directions, lengths = (to_array(part) for part in view.camera.rays())
    along = (np.where(known, depth, 0.0) * lengths.reshape(depth.shape))[keep]
    points = origins.reshape(-1, 3)[0] + directions.reshape(*depth.shape, 3)[keep] * along[:, None]
    return points, normal[keep], to_array(view.albedo)[keep]
