"""Highlights of a light where one view's pixels look, with their derivatives towards the light's position."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.renderer.glossy import mirrored, phong_lobe, phong_slope
from rgspipe.renderer.glossy_transport import GlossyTransport
from rgspipe.renderer.kernels.places import ways_to
from rgspipe.renderer.pixel_direct import PixelDirect
from rgspipe.renderer.pixel_lobe import only_columns
from rgspipe.scene.camera import Camera

#: A surfel that less of the light reaches has no relative slope of its shadow.
LEAST_PASSING = 1e-3


class PixelHighlights:
    """The specular image of a light as a function of its position.

    An entry of pixel p and surfel j with direct irradiance D gives k_s p_n(cos α) D, where α lies between the direction
    to the light from where the pixel looks and the eye's, mirrored at the surfel's normal. With r the distance, l the
    direction to the light and m the mirrored one,

        ∂(p_n D) = p_n' D (m − cos α · l)/r + p_n D (n/(r n·l) − 3 l/r + ∂T/T) ,

    the last bracket being D's own relative change. On a shadow's edge, where D has shadow rays of its own, ∂T/T is the
    surfel's.

    Args:
        gloss: of the scene, G glossy surfels of N.
        camera: whose view it is.
        direct: the direct light of P of its pixels.
    """

    def __init__(self, gloss: GlossyTransport, camera: Camera, direct: PixelDirect) -> None:
        self._gloss, self._direct = gloss, direct
        self._places, self._kept = only_columns(direct.weights, gloss.glossy)
        matrix = self._places.matrix
        self._columns = matrix.col_indices().long()
        counts = matrix.crow_indices().diff().long()
        self._rows = torch.repeat_interleave(torch.arange(len(counts)).to(counts), counts)
        eyes = torch.nn.functional.normalize(camera.origin.to(direct.points) - direct.points, dim=1)
        self._normals = gloss.geometry[1].float()[self._columns]
        self._mirrors = mirrored(eyes.float()[self._rows], self._normals)

    def image(self, position: Tensor, passing: Tensor, slope: Tensor) -> Tensor:
        """(P, 3, 4) radiance of the highlights of a light of 1 W/sr in RGB at `position`, (3,) or a place (4,), and
        its derivatives.

        Args:
            passing, slope: `pixel_direct.surfel_transmittance` of the light.
        """
        reflectance, exponents = self._gloss.material
        direct = self._direct.operator(position, passing).matrix.values()[self._kept]
        path = ways_to(position, self._direct.points).float()
        distance = path.norm(dim=1, keepdim=True).clamp(min=1e-20)
        towards, inverse = (path / distance)[self._rows], (1.0 / distance)[self._rows]
        cosines = (towards * self._mirrors).sum(dim=1)
        highlight = (phong_lobe(cosines, exponents[self._columns]) * direct)[:, None]
        turned = (phong_slope(cosines, exponents[self._columns]) * direct)[:, None]
        across = (towards * self._normals).sum(dim=1, keepdim=True).clamp(min=1e-4)
        relative = (self._normals / across - 3.0 * towards) * inverse
        surfels = self._gloss.glossy
        shaded = (slope[surfels] / passing[surfels].clamp(min=LEAST_PASSING)[:, None])[self._columns]
        slopes = turned * (self._mirrors - cosines[:, None] * towards) * inverse + highlight * (relative + shaded)
        entries = torch.cat([highlight, slopes], dim=1)
        return torch.stack([self._summed(column, reflectance) for column in entries.unbind(1)], dim=2)

    def _summed(self, entries: Tensor, reflectance: Tensor) -> Tensor:
        """(P, 3) sums over every pixel's entries (E,), times the surfels' reflectance (G, 3)."""
        return self._places.with_values(entries.contiguous()) @ reflectance
