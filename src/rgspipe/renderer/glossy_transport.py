"""Light to, between and from glossy surfels of a frozen scene, in spherical harmonics; and the image of it.

A glossy surfel sends out, beside its diffuse radiosity B (as radiance), Σ_k c_k Y_k(ω). With irradiance E of light
that comes from direction l, radiance b_p of the patches p and lobe coefficients λ (glossy.py):

    c = c⁰ + c' ,     c⁰ = k_s λ Y(l mirrored) E
    v_ip = b_p + Σ_k V_ip,k c_p,k                     radiance of patch p towards the glossy surfel i
    c'_ik = k_s λ_k Σ_p Q_ik,p v_ip                   reflected
    B_j = ρ_j (E_j/π + (F_p b)_j + Σ_p,k S_j,pk c_p,k)

As in the patch transport, the light between bounces is that of patches: b is the average of B, and c_p that of c over
the glossy surfels of patch p, by area. They are found first, bounce by bounce between gloss and with the patch
transport's inverse between diffuse surfaces, by the averages of the same equations over the receivers of a patch; then
the equations above are applied once. The highlight of a light itself, c⁰, is not taken from the harmonics in images but
from the exact lobe, which costs less and has no band limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.renderer.glossy import lobe_coefficients, mirrored, phong_lobe, soft_directions
from rgspipe.renderer.glossy_operators import GlossyOperators, build_glossy_operators
from rgspipe.renderer.kernels.places import homogeneous
from rgspipe.renderer.rig import RigResponse
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spherical_harmonics import coefficient_count, per_harmonic, real_harmonics
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.surfels import Surfels

#: Degree of the harmonics of indirect light. Degree 6 halves the error of a lobe of exponent 20, but leaves the image
#: as far from an exact path tracer's as it was, at twice the time and memory.
DEGREE = 4

#: Bounces between gloss end when the next one is below this part of the direct light …
TOLERANCE = 1e-4

#: … and after this many in any case. A closed room with ρ = k_s = ½ everywhere keeps 0.87 of its light a bounce.
MOST_BOUNCES = 64


@dataclass(frozen=True)
class GlossyTransport:
    """How light goes to, between and from the G glossy surfels of a scene, in K harmonics.

    Attributes:
        surfels: all N surfels of the scene, with their gloss; float32, centres may be float64.
        glossy: (G,) int64 which of them have k_s > 0.
        operators: R_g, S, V and Q.
    """

    surfels: Surfels
    glossy: Tensor
    operators: GlossyOperators

    def to(self, device: torch.device | str) -> GlossyTransport:
        """The same on another device."""
        return GlossyTransport(self.surfels.to(device), self.glossy.to(device), self.operators.to(device))

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
        """(…, G, 3) from the glossy surfels to points (…, 3) or places (…, 4)."""
        centers, normals, _ = self.geometry
        # The difference is taken in float64: far from the origin float32 knows neither of the two well enough.
        places = homogeneous(points).to(centers.device, torch.float64)[..., None, :]
        return (places[..., :3] - places[..., 3:] * centers.double()).to(normals)

    @cached_property
    def _weights(self) -> Tensor:
        """(G, K, 3, 1) k_s λ."""
        return (self.lobes[..., None] * self.material[0][:, None])[..., None]

    def directions(self, points: Tensor) -> Tensor:
        """(…, G, 3) unit directions from the glossy surfels to points (…, 3) or places (…, 4), with finite slopes."""
        return soft_directions(self.vectors(points), self.softening(points))

    def softening(self, points: Tensor) -> Tensor:
        """(…, G) scales by which directions to points (…, 3) or places (…, 4) are softened; 0 for infinity."""
        return homogeneous(points)[..., 3:].to(self.geometry[2]) * self.geometry[2]

    def light(self, transport: PatchTransport, response: RigResponse, indirect: bool = True) -> GlossyLight:
        """All light of the scene under a rig of L lights, differentiable towards their tensors.

        Args:
            transport: the diffuse bounces of the scene.
            response: of all N surfels to the rig.
            indirect: whether light that has been reflected is followed.
        """
        coloured = response.attached()[:, :, None] * response.intensities[:, None]
        radiance = self.surfels.albedo * coloured.sum(dim=0) / math.pi
        towards, on_gloss = self.directions(response.places), coloured[:, self.glossy]
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
        received, incident = self.received(transport, direct, emitted)
        return direct + transport.albedo[..., None] * received, self._weights * incident

    def received(self, transport: PatchTransport, direct: Tensor, emitted: Tensor) -> tuple[Tensor, Tensor]:
        """What `spread` reflects: the light that arrives from other surfels.

        Returns:
            irradiance over π (N, 3, C), and coefficients (G, K, 3, C) of the mirrored light at glossy surfels.
        """
        patches, averaged = self._between_bounces(transport, direct, emitted)
        received = transport.gather @ patches + self.operators.leaving @ averaged
        incident = self.operators.surfels.incident(patches, averaged)
        return received.reshape(direct.shape), incident.reshape(emitted.shape)

    def _between_bounces(self, transport: PatchTransport, direct: Tensor, emitted: Tensor) -> tuple[Tensor, Tensor]:
        """Light that leaves the patches, over all bounces but the last.

        Returns:
            diffuse radiance (P, 3·C), and coefficients (P_g·K, 3·C) averaged over the glossy surfels of each patch.
        """
        inner, counted = direct.shape[1:], transport.bounces is not None
        albedo = (transport.average @ transport.albedo)[..., None]
        weights = (self.operators.average @ self._weights.flatten(1)).reshape(-1, *self._weights.shape[1:])
        source = transport.average @ direct.flatten(1)
        leaving = (self.operators.average @ emitted.flatten(1)).reshape(-1, source.shape[1])
        diffuse, glossy = torch.zeros_like(source), torch.zeros_like(leaving)
        smallest = TOLERANCE * torch.maximum(_largest(source, inner), _largest(leaving, inner))
        for _ in range(transport.bounces if counted else MOST_BOUNCES):
            patches = source if counted else _all_bounces(transport, source, inner)
            diffuse, glossy = diffuse + patches, glossy + leaving
            source = (albedo * (self.operators.patch_leaving @ leaving).reshape(-1, *inner)).flatten(1)
            if counted:
                gathered = (transport.gather @ patches).reshape(-1, *inner)
                source = source + transport.average @ (transport.albedo[..., None] * gathered).flatten(1)
            incident = self.operators.patches.incident(patches, leaving)
            leaving = (weights * incident.reshape(-1, weights.shape[1], *inner)).reshape(leaving.shape)
            if bool((torch.maximum(_largest(source, inner), _largest(leaving, inner)) <= smallest).all()):
                break
        return diffuse, glossy

    def highlights(self, towards: Tensor, irradiance: Tensor) -> Tensor:
        """(…, G, K, 3) coefficients c⁰ for light from directions (…, G, 3) that makes irradiances (…, G, 3)."""
        harmonics = self.lobes * real_harmonics(mirrored(towards, self.geometry[1]), self.degree)
        return harmonics[..., None] * (self.material[0] * irradiance)[..., None, :]


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


def _largest(values: Tensor, inner: torch.Size) -> Tensor:
    """(C,) largest magnitude of each lighting in (…, 3·C)."""
    return values.detach().abs().reshape(-1, *inner).amax(dim=(0, 1))


def _all_bounces(transport: PatchTransport, source: Tensor, inner: torch.Size) -> Tensor:
    """H times patch radiances (P, 3·C)."""
    return torch.einsum("cpq,qck->pck", transport.inverse, source.reshape(-1, *inner)).flatten(1)
