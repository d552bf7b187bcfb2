"""Coarse images of every candidate light: what a search compares with the target in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.images.blocks import BlockModel
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.lights import Light, PointLight


@dataclass(frozen=True)
class CoarseImages:
    """What the views see of each candidate, averaged over blocks of pixels.

    Attributes:
        blocks: (B, P) averages the used pixels of a `PreparedViews` over blocks.
        counts: (B,) used pixels of each block.
        images: (C, B, 3) float32 of unit lights.
        positions: (C, 3) of the candidates.
        shapes: lights of the kind and of each shape that is tried, wherever they are.
        axes: (C, 3) of the candidates; None where they shine alike in all directions.
        which: (C,) int64 index into `shapes` of each candidate; None for the first.
        spacing: between neighbouring axes [rad].
    """

    blocks: SparseOperator
    counts: Tensor
    images: Tensor
    positions: Tensor
    shapes: tuple[Light, ...]
    axes: Tensor | None = None
    which: Tensor | None = None
    spacing: float = 0.0

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def square(self) -> Tensor:
        """(C, 3) float64 squared length of each image, every block as often as it has pixels."""
        counts = self.counts.to(self.images)
        return torch.einsum("kbc,kbc,b->kc", self.images, self.images, counts).double()

    def emitter(self, index: int, shape_free: bool = False) -> Emitter:
        """The candidate `index`."""
        shape = self.shapes[0 if self.which is None else int(self.which[index])]
        axis = None if self.axes is None else self.axes[index].double()
        return Emitter.of(shape.at(self.positions[index], axis), shape_free)


def coarse_images(model: BlockModel, dictionary: LightDictionary) -> CoarseImages:
    """Coarse images of all candidates by products of small matrices, instead of one rendering each."""
    images = model.seen(dictionary.irradiance.T).permute(2, 0, 1).contiguous()
    return CoarseImages(model.average, model.counts, images, dictionary.positions, (PointLight.shaped(),))
