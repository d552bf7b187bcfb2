"""What neighbouring surfels and a ray's hits should have in common when images alone do not say."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.machine.sums import average
from rgspipe.renderer.kernels.composite import Hits
from rgspipe.scene.surfels import Surfels

#: Neighbours of a surfel.
NEIGHBOURS = 8

#: Angle between normals [rad] at which two neighbours count half as one surface.
CREASE = 0.25


@dataclass(frozen=True)
class Neighbours:
    """Pairs of surfels on one surface; their weights are held while surfels move.

    Attributes:
        first, second: (E,) indices.
        weight: (E,) in [0, 1].
        spacing: typical distance of neighbours, scene units.
    """

    first: Tensor
    second: Tensor
    weight: Tensor
    spacing: float


def find_neighbours(surfels: Surfels, spacing: float) -> Neighbours:
    """The nearest surfels of each, weighted 1/(1 + (angle/CREASE)² + (offset/spacing)²)² so that edges stay."""
    centers, normals = surfels.centers.detach(), surfels.normals.detach()
    count = min(NEIGHBOURS + 1, len(surfels))
    features = torch.cat([centers, 2.0 * spacing * normals], dim=1).double().cpu().numpy()
    index = torch.from_numpy(cKDTree(features).query(features, k=count)[1].reshape(len(surfels), count))
    index = index.to(centers.device)
    first = torch.arange(len(surfels), device=centers.device).repeat_interleave(count - 1)
    second = index[:, 1:].reshape(-1)
    angle = (normals[first] - normals[second]).norm(dim=1)
    offset = _mean_plane_offset(centers, normals, first, second)
    weight = (1.0 + (angle / CREASE).square() + (offset / spacing).square()).pow(-2)
    near = (centers[first] - centers[second]).norm(dim=1) < 4.0 * spacing
    return Neighbours(first, second, weight * near, spacing)


def continuity(surfels: Surfels, pairs: Neighbours) -> Tensor:
    """Normals that agree with positions: mean of w (½(n_i + n_j)·(x_j − x_i)/spacing)².

    Zero on planes and on spheres, where the chord is at right angles to the mean normal; it ties the heights of
    surfels, which images hardly show, to their normals, which shading does. (2DGS compares the normals of surfels
    with those of the rendered depth: the same tie, in image space.)
    """
    offset = _mean_plane_offset(surfels.centers, surfels.normals, pairs.first, pairs.second)
    return average(pairs.weight * (offset / pairs.spacing).square())


def normal_smoothness(surfels: Surfels, pairs: Neighbours) -> Tensor:
    """Mean of w |n_i − n_j|²."""
    normals = surfels.normals
    return average(pairs.weight * (normals[pairs.first] - normals[pairs.second]).square().sum(dim=1))


def _mean_plane_offset(centers: Tensor, normals: Tensor, first: Tensor, second: Tensor) -> Tensor:
    return (0.5 * (normals[first] + normals[second]) * (centers[second] - centers[first])).sum(dim=1)


def distortion(surfels: Surfels, hits: Hits, origins: Tensor, directions: Tensor) -> Tensor:
    """Mean over rays of Σ_k w_k (t_k − t̄)² in units of the layer thickness squared, t̄ the weighted mean depth.

    2DGS's Σ_kl w_k w_l |t_k − t_l| squared, which then takes one pass; weights are held, depths are differentiable
    towards centres and normals. Only hits within one layer thickness of the mean count: a ray past an edge sees
    two surfaces that are rightly apart.
    """
    index = hits.indices.clamp(min=0).long()
    centers, normals = surfels.centers[index], surfels.normals[index]
    origins, directions = origins[:, None].to(centers), directions[:, None].to(centers)
    across = (directions * normals).sum(dim=-1)
    used = (hits.indices >= 0) & (across.abs() > 0.05)
    depth = ((centers - origins) * normals).sum(dim=-1) / torch.where(used, across, torch.ones_like(across))
    weight = torch.where(used, hits.weights, torch.zeros_like(hits.weights))
    total = weight.sum(dim=1, keepdim=True).clamp(min=1e-6)
    mean = (weight * depth.detach()).sum(dim=1, keepdim=True) / total
    thickness = surfels.coverage.layer_thickness
    weight = weight * ((depth.detach() - mean).abs() < thickness)
    mean = (weight * depth).sum(dim=1, keepdim=True) / weight.sum(dim=1, keepdim=True).clamp(min=1e-6)
    return average((weight * ((depth - mean) / thickness).square()).sum(dim=1))
