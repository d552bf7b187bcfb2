"""Light to, between and from glossy surfels of a frozen scene, in spherical harmonics; and the image of it.

A glossy surfel sends out, beside its diffuse radiosity B (as radiance), Σ_k c_k Y_k(ω). With irradiance E of light
that comes from direction l, radiance b_p of the patches p and lobe coefficients λ (glossy.py):

    c = c⁰ + c' ,     c⁰ = k_s λ Y(l mirrored) E
    v_ip = b_p + Σ_k V_ip,k c_p,k                     radiance of patch p towards the glossy surfel i
    c'_ik = k_s λ_k Σ_p Q_ik,p v_ip                   reflected
    B_j = ρ_j (E_j/π + (F_p b)_j + Σ_p,k S_j,pk c_p,k)

c_p is the average of c over the glossy surfels of patch p, by area; b = R B of all bounces comes from the patch
transport. Glossy bounces are added until they cannot matter. The highlight of a light itself, c⁰, is not taken from
the harmonics in images but from the exact lobe, which costs less and has no band limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.renderer.glossy import lobe_coefficients, mirrored, phong_lobe, soft_directions
from rgspipe.renderer.glossy_operators import GlossyOperators, build_glossy_operators
from rgspipe.renderer.rig import Rig, RigResponse
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spherical_harmonics import coefficient_count, per_harmonic, real_harmonics
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.surfels import Surfels

#: Degree of the harmonics of indirect light.
DEGREE = 6

#: Bounces between gloss end when the next one is below this part of the direct light …
TOLERANCE = 1e-4

#: … and after this many in any case, of which a closed room with ρ + k_s = 1 everywhere would need more.
MOST_BOUNCES = 64


@dataclass(frozen=True)
class GlossyTransport:
    """How light goes to, between and from the G glossy surfels of a scene, in K harmonics.

    Attributes:
        surfels: all N surfels of the scene, with their gloss.
        glossy: (G,) int64 which of them have k_s > 0.
        operators: R_g, S, V and Q.
    """

    surfels: Surfels
    glossy: Tensor
    operators: GlossyOperators

    @property
    def degree(self) -> int:
        """Degree of the harmonics."""
        return self.operators.degree

    @cached_property
    def geometry(self) -> tuple[Tensor, Tensor, Tensor]:
        """Centres (G, 3), unit normals (G, 3) and geometric-mean scales (G,) of the glossy surfels."""
        s, i = self.surfels, self.glossy
        return s.centers[i], s.normals[i], s.scales[i].prod(dim=1).sqrt()

    @cached_property
    def material(self) -> tuple[Tensor, Tensor]:
        """Specular reflectance (G, 3) and exponents (G,)."""
        return self.surfels.gloss.reflectance[self.glossy], self.surfels.gloss.exponents[self.glossy]

    @cached_property
    def lobes(self) -> Tensor:
        """(G, K) λ of every harmonic."""
        return per_harmonic(lobe_coefficients(self.material[1], self.degree))

    def vectors(self, points: Tensor) -> Tensor:
        """(…, G, 3) from the glossy surfels to points (…, 3)."""
        centers = self.geometry[0]
        # The difference is taken in float64: far from the origin float32 knows neither of the two well enough.
        return (points.to(centers.device, torch.float64)[..., None, :] - centers.double()).to(centers)

    def directions(self, points: Tensor) -> Tensor:
        """(…, G, 3) unit directions from the glossy surfels to points (…, 3), with a finite derivative everywhere."""
        return soft_directions(self.vectors(points), self.geometry[2])

    def light(self, transport: PatchTransport, rig: Rig, response: RigResponse, indirect: bool = True) -> GlossyLight:
        """All light of the scene under a rig of L lights, differentiable towards the rig's tensors.

        Args:
            transport: the diffuse bounces of the scene.
            response: of all N surfels to `rig`.
            indirect: whether light that has been reflected is followed.
        """
        intensities = rig.intensities.to(response.irradiance)
        coloured = _attached(rig, response)[:, :, None] * intensities[:, None]
        radiance = self.surfels.albedo * coloured.sum(dim=0) / math.pi
        towards, on_gloss = self.directions(rig.positions), coloured[:, self.glossy]
        reflected = radiance.new_zeros(len(self.glossy), coefficient_count(self.degree), 3)
        if indirect:
            emitted = self.highlights(towards, on_gloss).sum(dim=0)[..., None]
            radiance, reflected = (x[..., 0] for x in self.spread(transport, radiance[..., None], emitted))
        return GlossyLight(self, radiance, reflected, towards, on_gloss)

    def spread(self, transport: PatchTransport, direct: Tensor, emitted: Tensor) -> tuple[Tensor, Tensor]:
        """Follow light through as many bounces as `transport` has.

        Args:
            direct: (N, 3, C) direct diffuse radiosity (over π) of C lightings.
            emitted: (G, K, 3, C) coefficients of the lights' own highlights.

        Returns:
            radiance (N, 3, C) of the diffuse reflection, and coefficients (G, K, 3, C) of what glossy surfels reflect
            besides the highlights `emitted`.
        """
        counted = transport.bounces is not None
        smallest = TOLERANCE * torch.maximum(_largest(direct), _largest(emitted))
        radiance, reflected = direct, torch.zeros_like(emitted)
        for _ in range(transport.bounces if counted else MOST_BOUNCES):
            patches = _per_patch(transport, direct)
            averaged = _product(self.operators.average, emitted)
            by_patches = transport.albedo[..., None] * _product(transport.gather, patches)
            by_gloss = transport.albedo[..., None] * _product(self.operators.leaving, averaged)
            emitted = self._reflection(patches, averaged)
            radiance, reflected = radiance + by_patches + by_gloss, reflected + emitted
            # The inverse of the patch transport holds the diffuse bounces of `by_patches` already.
            direct = by_patches + by_gloss if counted else by_gloss
            if bool((torch.maximum(_largest(direct), _largest(emitted)) <= smallest).all()):
                break
        return radiance, reflected

    def highlights(self, towards: Tensor, irradiance: Tensor) -> Tensor:
        """(…, G, K, 3) coefficients c⁰ for light from directions (…, G, 3) that makes irradiances (…, G, 3)."""
        harmonics = self.lobes * real_harmonics(mirrored(towards, self.geometry[1]), self.degree)
        return harmonics[..., None] * (self.material[0] * irradiance)[..., None, :]

    def _reflection(self, patches: Tensor, averaged: Tensor) -> Tensor:
        """c' from radiances (P, 3, C) of all patches and coefficients (P_g, K, 3, C) of the glossy ones."""
        arriving = patches[self.operators.pair_patches] + _product(self.operators.between, averaged)
        incident = _product(self.operators.arriving, arriving).reshape(len(self.glossy), -1, *patches.shape[1:])
        return incident * self.lobes[:, :, None, None] * self.material[0][:, None, :, None]


@dataclass(frozen=True)
class GlossyLight:
    """The light of a scene with gloss, to be seen from anywhere.

    Attributes:
        transport: of the scene.
        radiance: (N, 3) of the diffuse reflection, the same in all directions.
        reflected: (G, K, 3) coefficients of the specular reflection of other surfels.
        towards: (L, G, 3) directions to the lights, irradiance: (L, G, 3) that they make: their highlights.
    """

    transport: GlossyTransport
    radiance: Tensor
    reflected: Tensor
    towards: Tensor
    irradiance: Tensor

    def seen_from(self, point: Tensor) -> Tensor:
        """(N, 3) radiance of every surfel towards a point (3,), e.g. a camera's origin."""
        gloss = self.transport
        reflectance, exponents = gloss.material
        eye = gloss.directions(point)
        cosines = (self.towards * mirrored(eye, gloss.geometry[1])).sum(-1)
        highlights = (phong_lobe(cosines, exponents)[..., None] * self.irradiance).sum(dim=0) * reflectance
        others = torch.einsum("gk,gkc->gc", real_harmonics(eye, gloss.degree), self.reflected)
        return self.radiance.index_add(0, gloss.glossy, highlights + others)


def build_glossy_transport(
    surfels: Surfels, gather: SparseOperator, transport: PatchTransport, degree: int = DEGREE
) -> GlossyTransport | None:
    """Glossy transport of a frozen scene; None if no surfel is glossy.

    Args:
        gather: (N, N) F, from which everything is made.
        transport: whose patches are used.
        degree: of the harmonics, at least 1.

    Raises:
        ValueError: the degree is below 1, or the gloss makes energy.
    """
    if degree < 1:
        raise ValueError(f"glossy transport needs harmonics of degree 1 or more, got {degree}")
    if surfels.gloss is None:
        return None
    surfels.gloss.check(surfels.albedo)
    glossy = surfels.gloss.glossy
    if not len(glossy):
        return None
    operators = build_glossy_operators(surfels, glossy, gather, transport.average, degree)
    return GlossyTransport(surfels, glossy, operators)


def _attached(rig: Rig, response: RigResponse) -> Tensor:
    """(L, N) irradiance of unit intensity that autograd knows how to differentiate towards the rig's tensors.

    What is added is zero, and its derivative is the response's: exact to first order, as any derivative is.
    """
    positions = (rig.positions - rig.positions.detach()).to(response.irradiance)
    irradiance = response.irradiance + torch.einsum("lnc,lc->ln", response.by_position, positions)
    if response.by_axis is None:
        return irradiance
    axes = (rig.axes - rig.axes.detach()).to(response.irradiance)
    return irradiance + torch.einsum("lnc,lc->ln", response.by_axis, axes)


def _largest(values: Tensor) -> Tensor:
    """(C,) largest magnitude of each lighting in (…, C)."""
    return values.detach().abs().reshape(-1, values.shape[-1]).amax(dim=0)


def _per_patch(transport: PatchTransport, direct: Tensor) -> Tensor:
    """(P, 3, C) radiance of the patches for direct radiosity (N, 3, C); with all diffuse bounces unless counted."""
    averaged = _product(transport.average, direct)
    return averaged if transport.bounces is not None else torch.einsum("cpq,qck->pck", transport.inverse, averaged)


def _product(operator: SparseOperator, operand: Tensor) -> Tensor:
    """Operator (R, M) times an operand whose leading dimensions make M: (R, …) with the operand's last dimensions.

    An operand (P_g, K, 3, C) counts as (P_g·K, 3, C).
    """
    (rows, columns), last = operator.shape, operand.shape[-2:]
    # Said in numbers, as torch infers no size where a scene has no pair of surfels that see each other.
    width = operand.numel() // columns if columns else last.numel()
    return (operator @ operand.reshape(columns, width)).reshape(rows, width // last.numel(), *last).squeeze(1)
