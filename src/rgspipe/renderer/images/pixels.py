"""Sharp images: direct light where pixels look, and from surfels' centres what bounces."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from rgspipe.renderer.effects import Effects
from rgspipe.renderer.extent import added
from rgspipe.renderer.images.glossy import bounced_light, seen_light, seen_with_gloss
from rgspipe.renderer.images.highlights import PixelHighlights
from rgspipe.renderer.images.model import ViewModel
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.kernels.lit_transmittance import LEAST_LIT
from rgspipe.renderer.lit_surfels import LitSurfels, lit_surfels
from rgspipe.renderer.pixel_direct import PixelDirect
from rgspipe.renderer.rig import RigResponse
from rgspipe.renderer.unit_light import OwnLight, Share, UnitLight, attenuated, emitted_intensity
from rgspipe.scene.lights import LightRig

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene


@dataclass(frozen=True)
class PixelModel(ViewModel):
    """How pixels see lights where they look.

    Attributes:
        direct: per view the direct light of its pixels.
        highlights: of a scene with gloss, per view their highlights.
    """

    direct: tuple[PixelDirect, ...]
    highlights: tuple[PixelHighlights, ...]

    @classmethod
    def of(cls, views: ViewedPixels, effects: Effects, direct: tuple[PixelDirect, ...] | None = None) -> PixelModel:
        """The model of some pixels.

        Args:
            direct: per view the direct light of these pixels, where it is known already.
        """
        frozen = views.frozen
        if direct is None:
            direct = tuple(PixelDirect(frozen.bvh, *pair) for pair in zip(views.views, views.own, strict=True))
        pairs = zip(views.views, direct, strict=True) if frozen.gloss is not None and effects.lobes else ()
        highlights = tuple(PixelHighlights(frozen.gloss, view.camera, one) for view, one in pairs)
        return cls(views, effects, direct, highlights)

    def on(self, views: ViewedPixels) -> PixelModel:
        if views.pixels is self.views.pixels:
            return replace(self, views=views)
        return replace(PixelModel.of(views, self.effects), few=self.few)

    def among(self, frozen: FrozenScene) -> PixelModel:
        return replace(super().among(frozen), direct=tuple(one.among(frozen.bvh) for one in self.direct))

    @cached_property
    def points(self) -> Tensor:
        """(P, 3) float64 place that each pixel looks at."""
        return torch.cat([direct.points for direct in self.direct])

    def columns(self, light: UnitLight) -> Tensor:
        columns, lit = added(light, self._columns, self.few)
        if self.gloss is not None or not self.effects.interreflection:
            return columns
        frozen = self.views.frozen
        return columns + self.views.seen(frozen.radiance(lit) - frozen.radiance(lit, indirect=False))

    def image(self, rig: LightRig) -> Tensor:
        frozen = self.views.frozen
        own = [
            OwnLight(part, share=Share(index, len(parts)))
            for parts in self.effects.parts(rig)
            for index, part in enumerate(parts)
        ]
        lit = [lit_surfels(frozen.bvh, light, self.effects) for light in own]
        response = RigResponse.of(frozen.bvh, tuple(light.given for light in own), lit)
        image = torch.zeros((len(self.views.pixels), 3), device=frozen.device)
        for light, one, intensity in zip(own, lit, response.intensities, strict=True):
            columns = self._direct(light, one)
            image = image + light.attached(columns[:, :, 0], columns[:, :, 1:]) * intensity
        if not own or not self.effects.interreflection:
            return image
        if self.gloss is not None:
            return image + seen_light(self.views, bounced_light(frozen, response))
        reflected = frozen.surfels.albedo * (response.summed() / math.pi)
        return image + self.views.seen(frozen.indirect(reflected[:, :, None]))[:, :, 0]

    def _columns(self, light: UnitLight) -> tuple[Tensor, Tensor]:
        """(P, 3, 1 + D) of a light in one point, without what bounces diffusely; and (N, 1 + D) its irradiance."""
        lit = lit_surfels(self.views.frozen.bvh, light, self.effects, LEAST_LIT)
        columns = self._direct(light, lit)
        if self.gloss is not None and self.effects.interreflection:
            place = light.light.place
            columns = columns + seen_with_gloss(self.views, place, lit.columns, True, bounced_only=True)
        return columns, lit.columns

    def _direct(self, light: UnitLight, lit: LitSurfels) -> Tensor:
        """(P, 3, 1 + D) direct light of a unit light."""
        place = light.light.place
        images = [direct.image(place, lit.passing, lit.slope, lit.origin, light.share) for direct in self.direct]
        for index, highlights in enumerate(self.highlights):
            images[index] = images[index] + highlights.image(place, lit.passing, lit.slope)
        columns = torch.cat(images)
        sent = None if light.light.axis is None else emitted_intensity(light, self.points, self.effects.spots)
        return attenuated(columns, sent, light)
