"""From composited hits to rows of sparse operators."""

from __future__ import annotations

import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits
from rgspipe.renderer.kernels.rows import compress

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
    starts, indices, values = (part.cpu().numpy() for part in compress(hits, weights, rays_per_row))
    return scipy.sparse.csr_matrix((values, indices, starts), shape=(len(starts) - 1, columns))
