"""What albedo is found from: photographs, how views show surfels under their light, and what is known besides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.scene.surfels import Surfels
from rgspipe.training.likeness import nearest_surfels
from rgspipe.training.photographs import Photographs
from rgspipe.training.view_model import LitViewModel

#: Albedo stays within these: below is numerically black, above rooms that never darken.
ALBEDO_RANGE = (0.005, 0.98)


@dataclass(frozen=True)
class AlbedoPrior:
    """What is known of the albedo before any image is explained.

    Attributes:
        albedo: (N, 3) expected.
        weight: (N,) how much it counts against the images, which weigh 1 in the median surfel; 0 for not at all.
    """

    albedo: Tensor
    weight: Tensor


@dataclass(frozen=True)
class AlbedoProblem:
    """What stays the same over the rounds.

    Attributes:
        models: of V views.
        photographs: of the same.
        neighbours: (N, 6) nearest surfels by position and normal.
    """

    models: Sequence[LitViewModel]
    photographs: Photographs
    neighbours: Tensor

    @classmethod
    def build(cls, surfels: Surfels, models: Sequence[LitViewModel], views: Sequence[View]) -> AlbedoProblem:
        """That of views, each with how it sees the surfels under its light."""
        albedo = surfels.albedo.float().clamp(*ALBEDO_RANGE)
        expected = [model.image(albedo, None) for model in models]
        photographs = Photographs.of(views, [model.weights.coverage for model in models], expected)
        return cls(models, photographs, nearest_surfels(surfels.centers, surfels.normals))

    def render(self, v: int, albedo: Tensor, indirect: Tensor | None) -> Tensor:
        """(pixels, 3) view v under `indirect` (V, N, 3)."""
        return self.models[v].image(albedo, None if indirect is None else indirect[v])
