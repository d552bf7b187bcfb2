"""What is known of surfaces that no camera saw before an image is looked at: which belong together, and their doubt."""

from __future__ import annotations

import numpy as np
import torch
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.scene.spacing import surfel_spacing
from rgspipe.scene.surfels import Surfels

#: Surfels no farther apart than so many of their distances, and turned by less than 45°, are of one surface.
TOGETHER, TURNED = 2.0, 0.7

#: Surfaces that are doubted on their own, the largest; all others are doubted together, as none of them does much.
MOST = 15

#: No guess is better than this: in white rooms whose walls are all alike, guesses were 0.05 to 0.06 off.
LEAST_DOUBT = 0.05


def spread_of_albedo(surfels: Surfels) -> Tensor:
    """() standard deviation of the logarithm of the albedo of all surfels that cameras saw: a guess has no other."""
    seen = surfels.albedo[surfels.guessed == 0.0].mean(dim=1).clamp(min=1e-3)
    return seen.log().std(correction=0).clamp(min=LEAST_DOUBT) if len(seen) else seen.new_tensor(LEAST_DOUBT)


def guessed_surfaces(surfels: Surfels) -> Tensor:
    """(S, N) of the surfels' type: 1 where a surfel is of a guessed surface, of S ≤ MOST + 1."""
    own = (surfels.guessed > 0.0).nonzero()[:, 0]
    marks = surfels.centers.new_zeros((0, len(surfels)))
    if not len(own):
        return marks
    labels = _together(surfels.centers[own].double().cpu(), surfels.normals[own].double().cpu(), _spacing(surfels))
    # The largest first; a stable order, so that equal ones do not depend on the machine.
    order = torch.bincount(labels).argsort(descending=True, stable=True)
    rank = torch.empty_like(order)
    rank[order] = torch.arange(len(order))
    chosen = rank[labels].clamp(max=MOST).to(own.device)
    marks = surfels.centers.new_zeros((int(chosen.max()) + 1, len(surfels)))
    marks[chosen, own] = 1.0
    return marks


def _spacing(surfels: Surfels) -> float:
    """Distance of neighbours; 0 where no two are of one surface."""
    try:
        return surfel_spacing(surfels.centers.cpu(), surfels.normals.cpu())
    except ValueError:
        return 0.0


def _together(centers: Tensor, normals: Tensor, spacing: float) -> Tensor:
    """(G,) int64 label of the surface that each of G surfels belongs to."""
    pairs = torch.from_numpy(cKDTree(centers.numpy()).query_pairs(TOGETHER * spacing, output_type="ndarray"))
    first, second = pairs[(normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(dim=1) > TURNED].T.numpy()
    count = len(centers)
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    return torch.from_numpy(connected_components(graph, directed=False)[1]).long()
