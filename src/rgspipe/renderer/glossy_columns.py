"""A unit light in a glossy scene and its three derivatives in one pass, as a Levenberg-Marquardt step needs them.

Everything after the surfels is linear, so value and derivatives go through the bounces together as four lightings; the
directions' own derivatives are those of the harmonics and of the lobe:

    ∂(Y E) = Y ∂E + (∇Y · ∂r) E ,      ∂(p E) = p ∂E + p'(cos α) (∂l · ω mirrored) E
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.glossy import mirrored, phong_lobe, phong_slope, soft_directions_and_slopes
from rgspipe.renderer.glossy_transport import GlossyTransport
from rgspipe.renderer.spherical_harmonics import coefficient_count, real_harmonics, real_harmonics_and_slopes
from rgspipe.renderer.transport import PatchTransport


@dataclass(frozen=True)
class GlossyColumns:
    """Light of a unit white light, and its derivatives towards x, y and z, as four lightings.

    Attributes:
        transport: of the scene.
        radiance: (N, 3, 4) of the diffuse reflection.
        reflected: (G, K, 3, 4) coefficients of the specular reflection of other surfels.
        towards: (G, 3) directions to the light; slopes: (G, 3, 3) their derivatives, the last index the light's axis.
        irradiance: (G, 4) of the light.
    """

    transport: GlossyTransport
    radiance: Tensor
    reflected: Tensor
    towards: Tensor
    slopes: Tensor
    irradiance: Tensor

    def seen_from(self, point: Tensor) -> Tensor:
        """(N, 3, 4) radiance of every surfel towards a point (3,), and its derivatives."""
        gloss = self.transport
        reflectance, exponents = gloss.material
        eye = gloss.directions(point)
        mirror = mirrored(eye, gloss.geometry[1])
        cosines = (self.towards * mirror).sum(-1)
        highlights = phong_lobe(cosines, exponents)[:, None] * self.irradiance
        turned = torch.einsum("gca,gc->ga", self.slopes, mirror)
        highlights[:, 1:] += phong_slope(cosines, exponents)[:, None] * turned * self.irradiance[:, :1]
        others = torch.einsum("gk,gkcl->gcl", real_harmonics(eye, gloss.degree), self.reflected)
        return self.radiance.index_add(0, gloss.glossy, reflectance[:, :, None] * highlights[:, None] + others)


def unit_light_columns(
    gloss: GlossyTransport,
    transport: PatchTransport,
    position: Tensor,
    irradiance: Tensor,
    slope: Tensor,
    indirect: bool = True,
) -> GlossyColumns:
    """The scene under a unit white light at `position`, (3,) or a place (4,).

    Args:
        transport: the diffuse bounces of the scene.
        irradiance: (N,) of the light; slope: (N, 3) its derivative towards the position.
        indirect: whether light that has been reflected is followed.
    """
    lit = torch.cat([irradiance[:, None], slope], dim=1)
    radiance = gloss.surfels.albedo[:, :, None] * (lit / math.pi)[:, None]
    on_gloss = lit[gloss.glossy]
    towards, slopes = soft_directions_and_slopes(gloss.vectors(position), gloss.softening(position))
    if indirect:
        emitted = _highlight_columns(gloss, towards, slopes, on_gloss)
        radiance, reflected = gloss.spread(transport, radiance, emitted)
    else:
        reflected = radiance.new_zeros(len(gloss.glossy), coefficient_count(gloss.degree), 3, 4)
    return GlossyColumns(gloss, radiance, reflected, towards, slopes, on_gloss)


def _highlight_columns(gloss: GlossyTransport, towards: Tensor, slopes: Tensor, irradiance: Tensor) -> Tensor:
    """(G, K, 3, 4) coefficients c⁰ of the light's own highlights, and their derivatives."""
    normals = gloss.geometry[1]
    harmonics, gradients = real_harmonics_and_slopes(mirrored(towards, normals), gloss.degree)
    turned = gradients @ mirrored(slopes.transpose(1, 2), normals[:, None]).transpose(1, 2)
    columns = harmonics[..., None] * irradiance[:, None]
    columns[..., 1:] += turned * irradiance[:, None, :1]
    return (gloss.lobes[..., None] * columns)[:, :, None] * gloss.material[0][:, None, :, None]
