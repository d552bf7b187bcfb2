"""Form factors in closed form, with visibility from a sampled gather operator: an alternative to the sampled one."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.scene.surfels import Surfels


def unoccluded_form_factors(surfels: Surfels, areas: Tensor) -> Tensor:
    """(N, N) float32 form factors between the surfels' centres and discs of area A_j, as if nothing stood between:

        F_ij = max(0, n_i·d) max(0, −n_j·d) A_j / (|d|² (π|d|² + A_j)) ,     d = c_j − c_i

    exact for a disc that faces the receiver on its axis, and bounded by 1 for discs that touch it (Wallace et al.
    1989). Takes N² memory, so it is for scenes of a few thousand surfels.

    Args:
        areas: (N,) A, scene units².
    """
    centers, normals = surfels.centers.float(), surfels.normals.float()
    offset = centers[None] - centers[:, None]
    square = offset.square().sum(dim=-1)
    receiver = torch.einsum("ijc,ic->ij", offset, normals).clamp(min=0.0)
    sender = torch.einsum("ijc,jc->ij", offset, -normals).clamp(min=0.0)
    return receiver * sender * areas / (square * (math.pi * square + areas)).clamp(min=1e-20)


def with_sampled_visibility(factors: Tensor, sampled: Tensor, labels: Tensor) -> Tensor:
    """(N, N) `factors` times the visibility of patches, with the row sums of a sampled operator.

    The visibility of patch p from surfel i is what was sampled of it over what would be seen without occluders,
    Σ_{j∈p} sampled_ij / Σ_{j∈p} factors_ij, at most 1.

    Args:
        factors: (N, N) unoccluded form factors; sampled: (N, N) gather operator; labels: (N,) int64 patches.
    """
    member = torch.nn.functional.one_hot(labels).float()
    visible = ((sampled @ member) / (factors @ member).clamp(min=1e-9)).clamp(max=1.0)
    result = factors * visible[:, labels]
    return result * (sampled.sum(dim=1) / result.sum(dim=1).clamp(min=1e-12))[:, None]
