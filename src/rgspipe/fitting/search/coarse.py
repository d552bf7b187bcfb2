"""Coarse images of every candidate light: what a search compares with the target in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.model.blocks import BlockModel
from rgspipe.fitting.model.parameters import Emitter
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spot import SpotShape


@dataclass(frozen=True)
class CoarseImages:
    """What the views see of each candidate, averaged over blocks of pixels.

    Attributes:
        blocks: (B, P) averages the used pixels of a `PreparedViews` over blocks.
        counts: (B,) used pixels of each block.
        images: (C, B, 3) float32 of unit lights.
        positions: (C, 3) of the candidates.
        axes: (C, 3) of spots; None for point lights.
        shapes: the spots' profiles; none for point lights.
        kinds: (C,) int64 index into `shapes` of each spot; None for point lights.
    """

    blocks: SparseOperator
    counts: Tensor
    images: Tensor
    positions: Tensor
    axes: Tensor | None = None
    shapes: tuple[SpotShape, ...] = ()
    kinds: Tensor | None = None

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def square(self) -> Tensor:
        """(C, 3) float64 squared length of each image, every block as often as it has pixels."""
        counts = self.counts.to(self.images)
        return torch.einsum("kbc,kbc,b->kc", self.images, self.images, counts).double()

    def emitter(self, index: int, cone_free: bool = False) -> Emitter:
        """The candidate `index`."""
        position = self.positions[index].double().cpu()
        if self.axes is None:
            return Emitter(position)
        axis = torch.nn.functional.normalize(self.axes[index].double().cpu(), dim=0)
        return Emitter(position, axis, self.shapes[int(self.kinds[index])], cone_free)


def coarse_images(frozen: FrozenScene, model: BlockModel, dictionary: LightDictionary) -> CoarseImages:
    """Coarse images of all candidates by products of small matrices, instead of one rendering each."""
    images = model.seen(frozen, dictionary.irradiance.T).permute(2, 0, 1).contiguous()
    return CoarseImages(model.average, model.counts, images, dictionary.positions)
