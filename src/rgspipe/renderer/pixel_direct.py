"""Direct light of one view, evaluated where its pixels look: sharper than surfels' centres, and dearer."""

from __future__ import annotations

from copy import copy
from functools import cache, cached_property

import numpy as np
import torch
from torch import Tensor

from rgspipe.renderer.kernels.irradiance import SOFTENING, transmittance
from rgspipe.renderer.kernels.pixel_light import REACH, PixelLight
from rgspipe.renderer.kernels.pixel_rays import pixel_rays
from rgspipe.renderer.kernels.pixel_shadow import pixel_transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.looked_at import on_planes
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.unit_light import WHOLE, Share
from rgspipe.renderer.view_weights import ViewWeights, even_places

#: Shadow rays of a pixel that a shadow's edge crosses, and of each point of a light with an extent at least: their
#: places differ, so that together they are as dense as those of a light in one point.
SHADOW_RAYS, LEAST_RAYS = 16, 2

#: A pixel whose surfels are lit by more than this and less than 1 minus this lies on a shadow's edge.
LIT_OR_NOT = 2e-3


class PixelDirect:
    """The direct image of a light as a function of its position.

    Inverse square and cosine are taken at the point that each pixel sees of each of its surfels. The
    transmittance is that of the surfels, and pixels on a shadow's edge, away from edges of the geometry, cast
    shadow rays of their own.

    Args:
        bvh: N surfels.
        view: the view.
        pixels: (P,) int64 those of it that are asked for; all if None.

    Attributes:
        weights: (P, N) of the view, of these pixels.
    """

    def __init__(self, bvh: SurfelBvh, view: ViewWeights, pixels: Tensor | None = None) -> None:
        self._bvh, self._camera = bvh, view.camera
        whole = pixels is None or len(pixels) == view.camera.pixel_count
        self._pixels = torch.arange(view.camera.pixel_count, device=bvh.device) if pixels is None else pixels
        self.weights = view.operator if whole else view.operator.rows(self._pixels)
        self._edges, self._coverage = view.edges[self._pixels], view.coverage[self._pixels]
        self._rays = pixel_rays(bvh, view.camera, self._pixels)
        scales = bvh.surfels.scales.detach().prod(dim=1).sqrt()
        self._light = PixelLight(bvh, self.weights.matrix, self._edges, self._rays, float(SOFTENING) * scales)
        self._receivers = _heaviest(self.weights)
        self._plain = ~self._edges & (self._coverage > 0.5)

    @cached_property
    def points(self) -> Tensor:
        """(P, 3) float64 place on the surface that each pixel's centre looks at, where spots are evaluated.

        It lies in the plane of the surfel with the largest weight; on edges, where that plane may be missed, within
        two and a half scales of its centre. In an empty scene it is the camera's.
        """
        surfels, receivers = self._bvh.surfels, self._receivers.to(self._bvh.device)
        origins, directions, _ = (part.to(self._bvh.device) for part in self._camera.rays(self._pixels))
        if not len(surfels):
            return origins.expand_as(directions)
        centers, normals = surfels.centers.double()[receivers], surfels.normals.double()[receivers]
        reach = float(REACH) * surfels.scales.detach().double().prod(dim=1).sqrt()[receivers]
        reach = torch.where(self._edges, reach, torch.full_like(reach, torch.inf))
        return on_planes(origins, directions, centers, normals, reach)

    def image(
        self,
        position: Tensor,
        passing: Tensor,
        slope: Tensor,
        origin: Tensor | None = None,
        share: Share = WHOLE,
    ) -> Tensor:
        """(P, 3, 4) radiance under a unit light in RGB at `position`, (3,) or a place (4,), and its slopes to x, y, z.

        Args:
            passing, slope: `surfel_transmittance` of the light.
            origin: (3,) or (4,) where shadow rays end; at the light if None.
            share: which of the points of a light it is.
        """
        own = self._own_passing(position if origin is None else origin, passing, share)
        return self._light.image(position, passing, slope, own)

    def among(self, bvh: SurfelBvh) -> PixelDirect:
        """The same pixels, looking at the same places, where surfels a little elsewhere cast other shadows."""
        other = copy(self)
        other._bvh = bvh
        return other

    def operator(self, position: Tensor, passing: Tensor) -> SparseOperator:
        """(P, N) irradiance per W/sr where each pixel looks on each surfel, times the view's weight of it.

        Times albedo over π this is `image` of surfels of any albedo.

        Args:
            passing: `surfel_transmittance` of the light.
        """
        entries = self._light.entries(position, passing, self._own_passing(position, passing, WHOLE))
        return self.weights.with_values(entries)

    def _own_passing(self, position: Tensor, passing: Tensor, share: Share) -> Tensor:
        """(P, 4) `own_passing` of `PixelLight.image`: of pixels on a shadow's edge."""
        lit = (self.weights @ passing[:, None])[:, 0] / self._coverage.clamp(min=1e-6)
        pixels = (self._plain & (lit > LIT_OR_NOT) & (lit < 1.0 - LIT_OR_NOT)).nonzero()[:, 0]
        places = edge_places(share)
        return pixel_transmittance(self._bvh, self._rays, self._receivers, pixels, position, places)


@cache
def edge_places(share: Share) -> Tensor:
    """(K, 2) places in a pixel of the shadow rays to one of a light's points."""
    return even_places(max(SHADOW_RAYS, LEAST_RAYS * share.count))[share.index :: share.count]


def surfel_transmittance(bvh: SurfelBvh, position: Tensor, shadows: bool = True) -> tuple[Tensor, Tensor]:
    """Transmittance (N,) of the way from a light at `position`, (3,) or a place (4,), to each surfel, and its
    derivative (N, 3)."""
    if not shadows:
        count = len(bvh.surfels)
        return torch.ones(count, device=bvh.device), torch.zeros(count, 3, device=bvh.device)
    passing, slope = transmittance(bvh, position[None])
    return passing[0], slope[0]


def _heaviest(operator: SparseOperator) -> Tensor:
    """(P,) int64 surfel with the largest weight in each pixel (row), the last one of several; 0 in empty ones."""
    matrix = operator.to_scipy()
    heaviest, counts = np.zeros(matrix.shape[0], np.int64), np.diff(matrix.indptr)
    rows = np.flatnonzero(counts)
    if len(rows):
        most = np.maximum.reduceat(matrix.data, matrix.indptr[rows])
        places = np.flatnonzero(matrix.data == np.repeat(most, counts[rows]))
        # Of places in one row, the last is written last.
        heaviest[np.searchsorted(matrix.indptr, places, side="right") - 1] = matrix.indices[places]
    return torch.from_numpy(heaviest)
