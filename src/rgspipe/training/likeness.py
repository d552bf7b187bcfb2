"""Which surfels are neighbours on one surface of one colour, and what their likeness weighs."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.renderer.sparse import SparseOperator

#: Step of albedo that counts as an edge.
ALBEDO_EDGE = 0.08


def nearest_surfels(centers: Tensor, others: Tensor) -> Tensor:
    """(N, ≤ 6) int64 nearest surfels by position over the scene's size and `others` (N, 3), e.g. normals."""
    size = float((centers.amax(dim=0) - centers.amin(dim=0)).amax())
    features = torch.cat([centers / max(size, 1e-12), 0.5 * others], dim=1).double().cpu().numpy()
    count = min(7, len(features))
    found = cKDTree(features).query(features, k=count, workers=-1)[1].reshape(len(features), -1)[:, 1:]
    return torch.from_numpy(found).to(centers.device)


def graph_laplacian(
    neighbours: Tensor, normals: Tensor | None, albedo: Tensor | None, guessed: Tensor | None = None
) -> Laplacian:
    """Graph Laplacian over neighbours on one surface (any if None); neighbours of another colour are let go.

    Args:
        guessed: (N,) bool, surfels that no image shows: where their surface changes its colour nobody knows.
    """
    count, degree = neighbours.shape
    column = neighbours.reshape(-1)
    row = torch.arange(count, device=column.device).repeat_interleave(degree)
    weight = torch.ones_like(row) if normals is None else (normals[row] * normals[column]).sum(dim=1) > 0.7
    weight = weight.float()
    if albedo is not None:
        step = (albedo[row] - albedo[column]).abs().amax(dim=1)
        if guessed is not None:
            step = step.masked_fill(guessed[row] | guessed[column], 0.0)
        weight = weight / (1.0 + (step / ALBEDO_EDGE).square())
    parts = (weight.cpu().numpy(), (row.cpu().numpy(), column.cpu().numpy()))
    adjacency = scipy.sparse.coo_matrix(parts, shape=(count, count)).tocsr()
    adjacency = 0.5 * (adjacency + adjacency.T)
    degrees = np.asarray(adjacency.sum(axis=1)).ravel()
    return Laplacian(scipy.sparse.diags(degrees) - adjacency, degrees, neighbours.device)


class Laplacian:
    """A symmetric operator and its diagonal."""

    def __init__(self, matrix: scipy.sparse.csr_matrix, degrees: np.ndarray, device: torch.device) -> None:
        self.sparse = matrix.tocsc()
        self.matrix = SparseOperator.from_scipy(matrix.tocsr(), device).matrix
        self._degrees = torch.from_numpy(degrees).float().to(device)

    def diagonal(self) -> Tensor:
        """(N,) float32 diagonal of the operator."""
        return self._degrees
