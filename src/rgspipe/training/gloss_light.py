"""The light of training views in a scene with gloss: what arrives at surfels, and what lobes send on to the cameras."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.renderer.glossy_operators import GlossyOperators, build_glossy_operators
from rgspipe.renderer.glossy_transport import DEGREE, GlossyTransport
from rgspipe.renderer.pixel_lobe import lobe_cosines, only_columns
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spherical_harmonics import coefficient_count, real_harmonics
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.surfels import Surfels
from rgspipe.training.gloss_model import GlossLight, Highlights, Reflection
from rgspipe.training.lighting import Lighting
from rgspipe.training.view_model import LitViewModel

#: The operators of glossy surfels (G,) int64.
OperatorsOf = Callable[[Tensor], GlossyOperators]

#: Coefficients of lightings that are carried through the transport at once; bounds the memory to about 100 MB.
VALUES_AT_ONCE = 8_000_000


def operators_from(surfels: Surfels, gather: SparseOperator, transport: PatchTransport) -> OperatorsOf:
    """Operators for any choice of glossy surfels.

    Args:
        gather: (N, N) which surfels each of them sees.
        transport: diffuse bounces, of any albedo, whose patches are used.
    """
    return lambda chosen: build_glossy_operators(surfels, chosen, gather, transport.average, DEGREE)


def highlight_light(
    surfels: Surfels,
    chosen: Tensor,
    models: Sequence[LitViewModel],
    lighting: Lighting,
    received: Tensor | None,
    at_pixels: bool,
) -> GlossLight:
    """Light of which lobes reflect only the part that comes straight from the lamps.

    Args:
        chosen: (G,) int64 surfels that may be glossy.
        models: of V views.
        received: (V, N, 3) light from other surfels over π.
        at_pixels: whether lobes are taken where pixels look, otherwise at surfels' centres.
    """
    found = []
    for model, position in zip(models, lighting.positions, strict=True):
        weights, kept = only_columns(model.weights.operator, chosen)
        direct = weights.with_values(model.direct.matrix.values()[kept])
        cosines = lobe_cosines(model.weights, weights, surfels, chosen, position, at_pixels)
        found.append(Highlights(direct, weights, cosines))
    return GlossLight(chosen, found, received, None)


@dataclass(frozen=True)
class GlossBounces:
    """All bounces of light in a scene with G glossy surfels, whatever their reflection.

    Attributes:
        surfels: N surfels, of any material.
        chosen: (G,) int64, not empty, in ascending order.
        operators: between them and the others.
    """

    surfels: Surfels
    chosen: Tensor
    operators: GlossyOperators

    def light(
        self, at: Reflection, transport: PatchTransport, lighting: Lighting, flat: GlossLight, eyes: Tensor
    ) -> GlossLight:
        """The light under every view's lamp if the surfels reflect as `at` says.

        Args:
            transport: diffuse bounces between surfels of that albedo.
            flat: `highlight_light` of the views.
            eyes: (V, 3) the cameras.
        """
        gloss = self._transport(at)
        count = max(1, VALUES_AT_ONCE // (3 * coefficient_count(DEGREE) * max(1, len(self.chosen))))
        parts = [
            self._arriving(gloss, transport, at.albedo, block, eyes, lighting)
            for block in torch.arange(len(eyes)).split(count)
        ]
        received, arriving = (torch.cat(part) for part in zip(*parts, strict=True))
        return replace(flat, received=received, arriving=arriving)

    def _transport(self, at: Reflection) -> GlossyTransport:
        count = len(self.surfels)
        reflectance = at.specular.new_zeros(count, 3).index_copy(0, self.chosen, at.specular)
        exponents = at.specular.new_ones(count).index_copy(0, self.chosen, at.log_exponents.exp())
        surfels = replace(self.surfels, albedo=at.albedo, gloss=Gloss(reflectance, exponents))
        return GlossyTransport(surfels, self.chosen, self.operators)

    def _arriving(
        self,
        gloss: GlossyTransport,
        transport: PatchTransport,
        albedo: Tensor,
        block: Tensor,
        eyes: Tensor,
        lighting: Lighting,
    ) -> tuple[Tensor, Tensor]:
        """(C, N, 3) L and (C, G, 3, degree + 1) m of C views."""
        coloured = lighting.irradiance[block][..., None] * lighting.intensity[block][:, None]
        direct = (albedo * coloured / math.pi).permute(1, 2, 0).contiguous()
        towards = gloss.directions(lighting.positions[block])
        emitted = gloss.highlights(towards, coloured[:, self.chosen]).permute(1, 2, 3, 0).contiguous()
        received, incident = gloss.received(transport, direct, emitted)
        weighted = real_harmonics(gloss.directions(eyes[block]), gloss.degree).permute(1, 2, 0)[:, :, None] * incident
        orders = [weighted[:, order**2 : (order + 1) ** 2].sum(dim=1) for order in range(gloss.degree + 1)]
        return received.permute(2, 0, 1), torch.stack(orders, dim=-1).permute(2, 0, 1, 3)
