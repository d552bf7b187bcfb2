"""Images of surfels with Phong lobes as functions of albedo, specular reflectance and exponent, and their slopes.

With E the irradiance of the light where pixels look, L the light that a surfel receives from others over π and M what
of that light a lobe of reflectance 1 sends to the camera:

    image = D ((ρ + π k_s p_n(cos α)) ∘ I) + W (ρ ∘ L + k_s ∘ M) ,     M = Σ_l λ_l(n) m_l

D and W are those of `view_model`, so coverage and shadows are the ones that albedo is fitted with. The image is linear
in ρ and k_s, and its lobe is taken where pixels look, like falloff and shadows (`renderer/pixel_lobe.py`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.glossy import lobe_coefficients, mirrored, phong_lobe
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.surfels import Surfels
from rgspipe.training.view_model import LitViewModel, products

#: Range of exponents: below, a lobe is hardly told from a diffuse surface; above, it is narrower than a pixel's surfel.
EXPONENT_RANGE = (1.0, 300.0)


@dataclass(frozen=True)
class Reflection:
    """The unknowns: what N surfels reflect, G of which may be glossy.

    Attributes:
        albedo: (N, 3) ρ.
        specular: (G, 3) k_s.
        log_exponents: (G,) ln n.
    """

    albedo: Tensor
    specular: Tensor
    log_exponents: Tensor

    def flat(self) -> Tensor:
        """All numbers in a row (3N + 4G,)."""
        return torch.cat([self.albedo.reshape(-1), self.specular.reshape(-1), self.log_exponents])

    def like(self, flat: Tensor) -> Reflection:
        """`flat` (3N + 4G,) in this one's shapes."""
        albedo, specular, logs = flat.split([self.albedo.numel(), self.specular.numel(), self.log_exponents.numel()])
        return Reflection(albedo.reshape(self.albedo.shape), specular.reshape(self.specular.shape), logs)


@dataclass(frozen=True)
class Highlights:
    """What one view sees of the G surfels that may be glossy.

    Attributes:
        direct: (P, G) columns of D.
        weights: (P, G) columns of W, in the same places.
        cosines: (E,) cos α of every entry.
    """

    direct: SparseOperator
    weights: SparseOperator
    cosines: Tensor

    def lobes(self, log_exponents: Tensor) -> tuple[SparseOperator, SparseOperator]:
        """(P, G) direct light times π p_n(cos α), and its slope towards ln n."""
        exponents = log_exponents.exp()[self.weights.matrix.col_indices().long()]
        values = self.direct.matrix.values() * math.pi * phong_lobe(self.cosines, exponents)
        # d p_n/d ln n = n (1/(n + 2) + ln cos α) p_n
        slopes = exponents * (1.0 / (exponents + 2.0) + self.cosines.clamp(min=1e-6).log()) * values
        return self.weights.with_values(values), self.weights.with_values(slopes)


@dataclass(frozen=True)
class GlossLight:
    """The light of V views on N surfels, G of which may be glossy; it is held while the reflection is solved for.

    Attributes:
        chosen: (G,) int64 which surfels may be glossy.
        highlights: of V views.
        received: (V, N, 3) L; None where light does not bounce.
        arriving: (V, G, 3, degree + 1) m_l; None where lobes reflect lights only.
    """

    chosen: Tensor
    highlights: Sequence[Highlights]
    received: Tensor | None
    arriving: Tensor | None

    def of_views(self, views: Sequence[int]) -> GlossLight:
        """The same for some of the views."""
        index = list(views)
        parts = (None if part is None else part[index] for part in (self.received, self.arriving))
        return GlossLight(self.chosen, [self.highlights[v] for v in views], *parts)

    def reflected(self, v: int, log_exponents: Tensor) -> tuple[Tensor, Tensor]:
        """(G, 3) M of view v and its slope towards ln n."""
        if self.arriving is None:
            nothing = log_exponents.new_zeros(len(log_exponents), 3)
            return nothing, nothing
        parts = _coefficients(log_exponents, self.arriving.shape[-1] - 1)
        value, slope = ((self.arriving[v] * part[:, None]).sum(dim=-1) for part in parts)
        return value, slope


def _coefficients(log_exponents: Tensor, degree: int) -> tuple[Tensor, Tensor]:
    """(G, degree + 1) λ, and its slope towards ln n by central differences in float64: exact to 1e-8."""
    logs, half = log_exponents.double(), 1e-4
    ahead, behind = (lobe_coefficients((logs + sign * half).exp(), degree) for sign in (1.0, -1.0))
    value = lobe_coefficients(log_exponents.exp(), degree)
    return value, ((ahead - behind) / (2.0 * half)).to(value)


@dataclass(frozen=True)
class GlossView:
    """One view with its light, linear around a reflection.

    Attributes:
        model: D and W.
        chosen: (G,) int64.
        received: (N, 3) L, or None.
        weights: (P, G) columns of W.
        lobes, lobe_slopes: (P, G) of `Highlights.lobes`, at the exponents that it is linear around.
        reflected, reflected_slope: (G, 3) M, there.
        specular: (G, 3) k_s that it is linear around, which the slope towards exponents is proportional to.
    """

    model: LitViewModel
    chosen: Tensor
    received: Tensor | None
    weights: SparseOperator
    lobes: SparseOperator
    lobe_slopes: SparseOperator
    reflected: Tensor
    reflected_slope: Tensor
    specular: Tensor

    @classmethod
    def of(cls, model: LitViewModel, light: GlossLight, v: int, at: Reflection) -> GlossView:
        """View `v` of those that share a light, linear around a reflection."""
        received = None if light.received is None else light.received[v]
        own = light.highlights[v]
        parts = *own.lobes(at.log_exponents), *light.reflected(v, at.log_exponents)
        return cls(model, light.chosen, received, own.weights, *parts, at.specular)

    def image(self, reflection: Reflection) -> Tensor:
        """(P, 3) radiance; its exponents are those that it is linear around."""
        own, intensity = reflection.specular, self.model.intensity
        image = self.model.image(reflection.albedo, self.received) + self.lobes.matrix @ (own * intensity)
        return image + self.weights.matrix @ (own * self.reflected)

    def change(self, step: Reflection) -> Tensor:
        """(P, 3) change of the image with a small step."""
        scaled = self.specular * step.log_exponents[:, None]
        image = self.image(step) + self.lobe_slopes.matrix @ (scaled * self.model.intensity)
        return image + self.weights.matrix @ (scaled * self.reflected_slope)

    def transposed(self, pixels: Tensor) -> Reflection:
        """The transpose of `change`, applied to (P, 3)."""
        intensity, bounced = self.model.intensity, self.weights.transposed @ pixels
        specular = intensity * (self.lobes.transposed @ pixels) + self.reflected * bounced
        logs = intensity * (self.lobe_slopes.transposed @ pixels) + self.reflected_slope * bounced
        return Reflection(self.model.transposed(pixels, self.received), specular, (self.specular * logs).sum(dim=1))

    def squared(self, pixel_weights: Tensor) -> Reflection:
        """Diagonal of the normal equations with weights (P,)."""
        specular = self._squared(self.lobes, self.reflected, pixel_weights)
        logs = self._squared(self.lobe_slopes, self.reflected_slope, pixel_weights)
        albedo = self.model.squared(pixel_weights, self.received)
        return Reflection(albedo, specular, (self.specular.square() * logs).sum(dim=1))

    def _squared(self, lobes: SparseOperator, reflected: Tensor, pixel_weights: Tensor) -> Tensor:
        """(G, 3) Σ_p w_p (H_pj I + W_pj M_j)²."""
        squared, mixed, weighted = products(lobes, self.weights, pixel_weights)
        direct = self.model.intensity
        return squared * direct.square() + 2.0 * mixed * direct * reflected + weighted * reflected.square()


def centre_cosines(surfels: Surfels, chosen: Tensor, lights: Tensor, eyes: Tensor) -> Tensor:
    """(V, G) cos α at the centres of the surfels `chosen` (G,), of lights and cameras (V, 3)."""
    centers, normals = surfels.centers.double()[chosen], surfels.normals.double()[chosen]
    towards, eye = (
        torch.nn.functional.normalize(points.to(centers)[:, None] - centers, dim=-1) for points in (lights, eyes)
    )
    return (towards * mirrored(eye, normals)).sum(-1).float()
