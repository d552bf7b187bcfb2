"""View weights: the sparse operator that turns the radiance of surfels into an image."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surface import mean_surface
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rays import normalised_weights, rows_from_hits
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.camera import Camera

#: Rays cast at once: so few that their hits stay in the processor's cache until they are packed.
RAYS_AT_ONCE = 16_384

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
        edges: (pixels,) bool, pixels on a silhouette, a crease or a depth jump, and their neighbours.
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
    parts, seen = zip(*(_cast(bvh, camera, block) for block in _blocks(torch.arange(camera.pixel_count))), strict=True)
    crossed = _crossed_pixels(camera, *(torch.cat(column) for column in zip(*seen, strict=True)))
    matrix = scipy.sparse.vstack(parts, format="csr")
    if supersampling > 1 and bool(crossed.any()):
        chosen = crossed.reshape(-1).nonzero()[:, 0]
        places = even_places(supersampling**2)
        blocks = _blocks(chosen, len(places))
        fine = scipy.sparse.vstack([_cast(bvh, camera, block, places)[0] for block in blocks], format="csr")
        matrix = _replace_rows(matrix, chosen.numpy(), fine)
    coverage = torch.from_numpy(matrix.sum(axis=1)).float().reshape(-1)
    edges = scipy.ndimage.binary_dilation(crossed.numpy(), structure=np.ones((3, 3)))
    return ViewWeights(
        camera, SparseOperator.from_scipy(matrix, bvh.device), torch.from_numpy(edges).reshape(-1), coverage
    )


def nearest_hit(bvh: SurfelBvh) -> float:
    """Hits nearer than this to a ray's origin are the origin's own surface, scene units."""
    return 0.02 * bvh.coverage.layer_thickness


def even_places(count: int) -> Tensor:
    """(count, 2) float64 places in the unit square: a rank-1 lattice whose rows and columns hold one place each.

    An edge along an axis is resolved to 1/count of a pixel, where a square grid resolves 1/√count. The multiplier
    is the one nearest to the golden section (Korobov 1959 has the lattices, Niederreiter 1992 the reason).
    """
    coprime = [k for k in range(1, count + 1) if math.gcd(k, count) == 1]
    multiplier = min(coprime, key=lambda k: abs(k - 0.618034 * count))
    k = torch.arange(count, dtype=torch.float64)
    return torch.stack([k + 0.5, (multiplier * k) % count + 0.5], dim=1) / count


def _blocks(pixels: Tensor, rays: int = 1) -> tuple[Tensor, ...]:
    return pixels.split(max(1, RAYS_AT_ONCE // rays))


def _cast(
    bvh: SurfelBvh, camera: Camera, pixels: Tensor, places: Tensor | None = None
) -> tuple[scipy.sparse.csr_matrix, tuple[Tensor, Tensor, Tensor]]:
    """Rows of `pixels` (P,), and of each ray the mean normal, the inverse planar depth and the transmittance."""
    origins, directions, lengths = camera.rays(pixels, places=places)
    hits = composite(bvh, origins, directions, nearest=nearest_hit(bvh))
    normal, distance = mean_surface(hits, bvh.surfels.normals.float())
    inverse = lengths.float() / distance.cpu().clamp(min=1e-6)
    rows = rows_from_hits(hits, normalised_weights(hits), len(origins) // len(pixels), len(bvh.surfels))
    return rows, (normal.cpu(), inverse, hits.transmittance.cpu())


def _replace_rows(
    matrix: scipy.sparse.csr_matrix, chosen: np.ndarray, rows: scipy.sparse.csr_matrix
) -> scipy.sparse.csr_matrix:
    """`matrix` with the rows `chosen` (K,) taken from `rows` (K, …)."""
    order = np.arange(matrix.shape[0])
    order[chosen] = matrix.shape[0] + np.arange(len(chosen))
    return scipy.sparse.vstack([matrix, rows], format="csr")[order]


def _crossed_pixels(camera: Camera, normal: Tensor, inverse: Tensor, passing: Tensor) -> Tensor:
    """(height, width) bool: pixels that differ from a neighbour in normal, inverse depth or coverage.

    A straight edge that crosses a pixel parts its centre from that of one of its four neighbours, so these are
    all that such an edge crosses.
    """
    height, width = camera.height, camera.width
    normal, inverse, passing = normal.reshape(height, width, 3), *(x.reshape(height, width) for x in (inverse, passing))
    covered = passing < 0.5
    crossed = ((passing > 0.02) & (passing < 0.98)) | ((normal.norm(dim=2) < 0.95) & covered)
    for axis in (0, 1):
        count = crossed.shape[axis] - 1
        low, high = inverse.narrow(axis, 0, count), inverse.narrow(axis, 1, count)
        jump = normal.diff(dim=axis).abs().sum(dim=2) > NORMAL_JUMP
        jump |= passing.diff(dim=axis).abs() > COVERAGE_JUMP
        jump |= ((high - low).abs() > DEPTH_JUMP * torch.minimum(low, high)) & (
            covered.narrow(axis, 0, count) & covered.narrow(axis, 1, count)
        )
        crossed.narrow(axis, 0, count).logical_or_(jump)
        crossed.narrow(axis, 1, count).logical_or_(jump)
    return crossed
