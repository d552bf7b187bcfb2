"""From composited hits to rows of sparse operators."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits

#: A ray that is stopped by more than this meets a surface, and the share that leaks past it is noise of the
#: representation; one that is stopped by less really sees past an edge.
SURFACE_SHARE = 0.5


def normalised_weights(hits: Hits) -> Tensor:
    """(R, K) weights that sum to 1 in rays that meet a surface, and are left alone in rays past an edge."""
    stopped = 1.0 - hits.transmittance
    gain = torch.where(stopped > SURFACE_SHARE, 1.0 / stopped.clamp(min=SURFACE_SHARE), torch.ones_like(stopped))
    return hits.weights * gain[:, None]


def rows_from_hits(hits: Hits, weights: Tensor, rays_per_row: int, columns: int) -> scipy.sparse.csr_matrix:
    """(R / rays_per_row, columns) matrix; each row is the mean of `rays_per_row` successive rays."""
    kept = (hits.indices >= 0).cpu().numpy()
    counts = kept.sum(axis=1).reshape(-1, rays_per_row).sum(axis=1)
    starts = np.concatenate([[0], np.cumsum(counts)])
    indices = hits.indices.cpu().numpy()[kept]
    values = weights.cpu().numpy()[kept] / np.float32(rays_per_row)
    matrix = scipy.sparse.csr_matrix((values, indices, starts), shape=(len(counts), columns))
    matrix.sum_duplicates()
    return matrix
