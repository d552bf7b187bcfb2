"""View weights: the sparse operator that turns the radiance of surfels into an image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits, composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rays import normalised_weights, rows_from_hits
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.camera import Camera

#: Neighbouring pixels whose mean normals differ by more (L1) see different surfaces.
NORMAL_JUMP = 0.3

#: … and so do those whose inverse depths differ by more than this part.
DEPTH_JUMP = 0.12

#: … or whose coverages differ by more.
COVERAGE_JUMP = 0.3


@dataclass(frozen=True)
class ViewWeights:
    """A camera's image as a linear function of the surfels' radiance.

    Attributes:
        camera: whose image it is.
        operator: (pixels, N) weights; `operator @ radiance` is the image, rows in pixel order.
        edges: (pixels,) bool, pixels on or beside a silhouette, a crease or a depth jump.
        coverage: (pixels,) share of each pixel that is covered by surfels.
    """

    camera: Camera
    operator: SparseOperator
    edges: Tensor
    coverage: Tensor

    def image(self, radiance: Tensor) -> Tensor:
        """(height, width, 3) image of surfels with outgoing radiance (N, 3)."""
        return (self.operator @ radiance).reshape(self.camera.height, self.camera.width, -1)


def build_view_weights(bvh: SurfelBvh, camera: Camera, supersampling: int = 4) -> ViewWeights:
    """Trace a camera once: one ray in plain pixels, `supersampling`² in those on edges.

    Inside a surface radiance changes little across a pixel and its centre stands for it; on an edge a
    pixel is the mean over its area, as a box-filtered photograph is.
    """
    origins, directions, lengths = camera.rays()
    hits = composite(bvh, origins.float(), directions.float(), nearest=nearest_hit(bvh))
    edges = _edge_pixels(bvh, hits, camera, lengths)
    matrix = rows_from_hits(hits, normalised_weights(hits), 1, len(bvh.surfels))
    if supersampling > 1 and bool(edges.any()):
        chosen = edges.nonzero()[:, 0]
        fine_origins, fine_directions, _ = camera.rays(chosen, supersampling)
        fine = composite(bvh, fine_origins.float(), fine_directions.float(), nearest=nearest_hit(bvh))
        rows = rows_from_hits(fine, normalised_weights(fine), supersampling**2, len(bvh.surfels))
        matrix = _replace_rows(matrix, chosen, rows)
    coverage = torch.from_numpy(matrix.sum(axis=1)).float().reshape(-1)
    return ViewWeights(camera, SparseOperator.from_scipy(matrix, bvh.device), edges, coverage)


def nearest_hit(bvh: SurfelBvh) -> float:
    """Hits nearer than this to a ray's origin are the origin's own surface, scene units."""
    return 0.02 * bvh.coverage.layer_thickness


def _replace_rows(
    matrix: scipy.sparse.csr_matrix, chosen: Tensor, rows: scipy.sparse.csr_matrix
) -> scipy.sparse.csr_matrix:
    """`matrix` with the rows `chosen` (K,) taken from `rows` (K, …)."""
    kept = np.ones(matrix.shape[0])
    kept[chosen.numpy()] = 0.0
    place = scipy.sparse.csr_matrix(
        (np.ones(len(chosen)), (chosen.numpy(), np.arange(len(chosen)))), shape=(matrix.shape[0], len(chosen))
    )
    result = scipy.sparse.diags(kept) @ matrix + place @ rows
    result.eliminate_zeros()
    return result.tocsr()


def _edge_pixels(bvh: SurfelBvh, hits: Hits, camera: Camera, lengths: Tensor) -> Tensor:
    """(pixels,) bool: neighbours that differ in normal, inverse depth or coverage, and a margin of one pixel."""
    height, width = camera.height, camera.width
    index = hits.indices.clamp(min=0).long()
    weights = torch.where(hits.indices >= 0, hits.weights, torch.zeros_like(hits.weights))
    stopped = weights.sum(dim=1).clamp(min=1e-6)
    normal = torch.einsum("rk,rkc->rc", weights, bvh.surfels.normals.float()[index]) / stopped[:, None]
    distance = torch.where(hits.indices >= 0, hits.depths, torch.zeros_like(hits.depths))
    depth = (weights * distance).sum(dim=1) / stopped / lengths.float().to(weights.device)
    normal = normal.reshape(height, width, 3).cpu()
    inverse = (1.0 / depth.clamp(min=1e-6)).reshape(height, width).cpu()
    passing = hits.transmittance.reshape(height, width).cpu()
    covered = passing < 0.5
    bad = ((passing > 0.02) & (passing < 0.98)) | ((normal.norm(dim=2) < 0.95) & covered)
    for axis in (0, 1):
        count = bad.shape[axis] - 1
        low, high = inverse.narrow(axis, 0, count), inverse.narrow(axis, 1, count)
        jump = normal.diff(dim=axis).abs().sum(dim=2) > NORMAL_JUMP
        jump |= passing.diff(dim=axis).abs() > COVERAGE_JUMP
        jump |= ((high - low).abs() > DEPTH_JUMP * torch.minimum(low, high)) & (
            covered.narrow(axis, 0, count) & covered.narrow(axis, 1, count)
        )
        bad.narrow(axis, 0, count).logical_or_(jump)
        bad.narrow(axis, 1, count).logical_or_(jump)
    grown = scipy.ndimage.binary_dilation(bad.numpy(), structure=np.ones((3, 3)))
    return torch.from_numpy(grown).reshape(-1)
