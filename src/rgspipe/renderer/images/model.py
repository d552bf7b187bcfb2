"""What all models of an image have in common, and the soft one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self, TypeAlias

import torch
from torch import Tensor

from rgspipe.renderer.effects import Effects
from rgspipe.renderer.extent import added
from rgspipe.renderer.glossy_transport import GlossyLight, GlossyTransport
from rgspipe.renderer.images.glossy import seen_light, seen_with_gloss
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.kernels.lit_transmittance import LEAST_LIT
from rgspipe.renderer.lit_surfels import lit_columns, lit_surfels
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.unit_light import UnitLight
from rgspipe.scene.lights import LightRig

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene

#: The light of a scene: (N, 3) outgoing radiance of diffuse surfels, or what gloss needs besides.
Lit: TypeAlias = Tensor | GlossyLight


class ImageModel(ABC):
    """How P pixels, or blocks of pixels, see a light.

    Attributes:
        effects: parts of light transport.
        view_of: (P,) int64 view of each.
        bounds: V + 1 places: view v has those from bounds[v] to bounds[v + 1].
        counts: (P,) float64 pixels that each stands for.
        average: (P, pixels) averages pixels over blocks; None where these are pixels.
    """

    effects: Effects
    view_of: Tensor
    bounds: list[int]
    counts: Tensor
    average: SparseOperator | None

    @abstractmethod
    def columns(self, light: UnitLight) -> Tensor:
        """(P, 3, 1 + D) float32 image of a unit light, and its derivatives towards the light's numbers."""

    def renderings(self, light: UnitLight) -> int:
        """How many images `columns` makes of a light."""
        return 1

    def of_few_points(self) -> ImageModel:
        """The same with lights of few points (`Light.nodes`); itself where it takes no more anyway."""
        return self


@dataclass(frozen=True)
class ViewModel(ImageModel):
    """How pixels of views see lights.

    Attributes:
        views: the pixels.
        effects: parts of light transport.
        few: whether lights with an extent are seen as few points, see `Light.nodes`.
    """

    views: ViewedPixels
    effects: Effects
    few: bool = field(default=False, kw_only=True)

    def of_few_points(self) -> Self:
        return replace(self, few=True)

    @property
    def view_of(self) -> Tensor:
        return self.views.view_of

    @property
    def bounds(self) -> list[int]:
        return self.views.bounds

    @property
    def counts(self) -> Tensor:
        return torch.ones(len(self.views.pixels)).double()

    @property
    def average(self) -> None:
        return None

    @property
    def gloss(self) -> GlossyTransport | None:
        """How light goes over glossy surfels; None where that is not simulated."""
        return self.views.frozen.gloss if self.effects.lobes else None

    @classmethod
    @abstractmethod
    def of(cls, views: ViewedPixels, effects: Effects) -> Self:
        """The model of some pixels."""

    def on(self, views: ViewedPixels) -> Self:
        """The model for other pixels of the same views."""
        return replace(self, views=views)

    def among(self, frozen: FrozenScene) -> Self:
        """The model of the same pixels where surfels of a scene like it cast other shadows; see `displaced`."""
        return replace(self, views=replace(self.views, frozen=frozen))

    @abstractmethod
    def image(self, rig: LightRig) -> Tensor:
        """(P, 3) float32 radiance under a rig, differentiable towards the tensors of its lights, once.

        The lights are added up before their light bounces, so a rig costs as many bounces as one light.
        """


@dataclass(frozen=True)
class SurfelModel(ViewModel):
    """Soft images: the radiance of surfels at their centres, seen through the views' weights."""

    @classmethod
    def of(cls, views: ViewedPixels, effects: Effects) -> SurfelModel:
        return cls(views, effects)

    def columns(self, light: UnitLight) -> Tensor:
        frozen, bounces = self.views.frozen, self.effects.interreflection
        if self.gloss is None:
            lit = lit_columns(frozen.bvh, light, self.effects, LEAST_LIT, self.few)
            return self.views.seen(frozen.radiance(lit, bounces))

        def glossy(part: UnitLight) -> tuple[Tensor]:
            lit = lit_surfels(frozen.bvh, part, self.effects, LEAST_LIT).columns
            return (seen_with_gloss(self.views, part.light.place, lit, bounces),)

        (columns,) = added(light, glossy, self.few)
        return columns

    def image(self, rig: LightRig) -> Tensor:
        return self.seen(self.lit(rig))

    def lit(self, rig: LightRig) -> Lit:
        """The light of the scene under a rig, from wherever it is looked at."""
        frozen = self.views.frozen
        return (frozen.radiance_of if self.gloss is None else frozen.glossy_light)(rig, self.effects)

    def seen(self, lit: Lit) -> Tensor:
        """(P, 3) what the pixels see of it."""
        return self.views.operator @ lit if isinstance(lit, Tensor) else seen_light(self.views, lit)
