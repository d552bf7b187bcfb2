"""View weights: the sparse operator that turns the radiance of surfels into an image."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.arguments import as_one_of
from rgspipe.errors import InputError
from rgspipe.machine.description import available_memory_gib
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_edges import Seen, pixels_beside_edges, pixels_on_edges
from rgspipe.renderer.rays import normalised_weights, rows_from_hits
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.camera import Camera

#: Rays cast at once: so few that their hits stay in the processor's cache until they are packed.
RAYS_AT_ONCE = 32_768

#: What a picture takes while its camera is traced, bytes a pixel: 220 to 340 were measured in the Cornell box.
PIXEL_BYTES = 200


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
    """Trace a camera once: one ray in plain pixels, `supersampling`² in those that an edge crosses.

    Inside a surface radiance changes little across a pixel and its centre stands for it; on an edge a
    pixel is the mean over its area, as a box-filtered photograph is.

    Raises:
        InputError: no camera, but something else, or a picture that does not fit into memory.
    """
    as_one_of(camera, Camera, "camera", "Camera.look_at makes one.")
    _check_memory(camera)
    pixels = torch.arange(camera.pixel_count)
    parts, seen = zip(*(_centres(bvh, camera, block) for block in _blocks(pixels)), strict=True)
    centres = Seen.joined(seen).reshape(camera.height, camera.width)
    beside = pixels_beside_edges(centres)
    matrix = scipy.sparse.vstack(parts, format="csr")
    if supersampling > 1 and bool(beside.any()):
        chosen = pixels_on_edges(bvh, camera, centres, beside, nearest_hit(bvh))
        places = even_places(supersampling**2)
        blocks = _blocks(chosen, len(places))
        fine = scipy.sparse.vstack([_rows(bvh, camera, block, places) for block in blocks], format="csr")
        matrix = _replace_rows(matrix, chosen.numpy(), fine)
    coverage = torch.from_numpy(matrix.sum(axis=1)).float().reshape(-1)
    edges = torch.from_numpy(scipy.ndimage.binary_dilation(beside.numpy(), structure=np.ones((3, 3)))).reshape(-1)
    operator = SparseOperator.from_scipy(matrix, bvh.device)
    return ViewWeights(camera, operator, edges.to(bvh.device), coverage.to(bvh.device))


def _check_memory(camera: Camera) -> None:
    """Refuse a picture that would take all memory, before the first ray; what fits can still be too much."""
    need, free = camera.pixel_count * PIXEL_BYTES / 2**30, available_memory_gib()
    if free is not None and need > free:
        found = f"{camera.width} × {camera.height} pixels, which take {need:.0f} GiB where {free:.0f} are free"
        remedy = "Make the picture smaller, for example with Camera.reduced."
        raise InputError("camera", expected="a picture that fits into memory", found=found, remedy=remedy)


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


def _centres(bvh: SurfelBvh, camera: Camera, pixels: Tensor) -> tuple[scipy.sparse.csr_matrix, Seen]:
    """Rows of `pixels` (P,) with one ray each, and what it sees."""
    origins, directions, lengths = camera.rays(pixels)
    hits = composite(bvh, origins, directions, nearest=nearest_hit(bvh))
    return rows_from_hits(hits, normalised_weights(hits), 1, len(bvh.surfels)), Seen.of(bvh, hits, lengths)


def _rows(bvh: SurfelBvh, camera: Camera, pixels: Tensor, places: Tensor) -> scipy.sparse.csr_matrix:
    """Rows of `pixels` (P,) with one ray through each of `places` (K, 2)."""
    origins, directions, _ = camera.rays(pixels, places=places)
    hits = composite(bvh, origins, directions, nearest=nearest_hit(bvh))
    return rows_from_hits(hits, normalised_weights(hits), len(places), len(bvh.surfels))


def _replace_rows(
    matrix: scipy.sparse.csr_matrix, chosen: np.ndarray, rows: scipy.sparse.csr_matrix
) -> scipy.sparse.csr_matrix:
    """`matrix` with the rows `chosen` (K,) taken from `rows` (K, …)."""
    order = np.arange(matrix.shape[0])
    order[chosen] = matrix.shape[0] + np.arange(len(chosen))
    return scipy.sparse.vstack([matrix, rows], format="csr")[order]
