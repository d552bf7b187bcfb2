"""Coarse images of every candidate light: what a search compares with the target in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.fitting.dictionary import LightDictionary, patch_radiance
from rgspipe.fitting.parameters import Emitter
from rgspipe.fitting.views import PreparedViews
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spot import SpotShape

#: A coarse image has at most this many blocks along each side.
BLOCKS = 16


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

    def emitter(self, index: int, cone_free: bool = False) -> Emitter:
        """The candidate `index`."""
        position = self.positions[index].double().cpu()
        if self.axes is None:
            return Emitter(position)
        axis = torch.nn.functional.normalize(self.axes[index].double().cpu(), dim=0)
        return Emitter(position, axis, self.shapes[int(self.kinds[index])], cone_free)


@dataclass(frozen=True)
class BlockModel:
    """How blocks of pixels see light, per channel.

    Attributes:
        blocks, counts: see `CoarseImages`.
        weights: (B, N) block averages of the view weights.
        shaded: 3 sparse (B, N), `weights` times albedo: direct radiosity over albedo to blocks, times π.
        bounced: 3 tensors (B, patches), from the patches' direct radiosity to what blocks see of it after bounces; none
            without interreflection.
    """

    blocks: SparseOperator
    counts: Tensor
    weights: scipy.sparse.csr_matrix
    shaded: tuple[SparseOperator, ...]
    bounced: tuple[Tensor, ...]


def block_model(views: PreparedViews, blocks: int = BLOCKS, *, interreflection: bool = True) -> BlockModel:
    """With W_c the block averages of the view weights, and in the notation of `PatchTransport`, the image of channel c
    is W_c ρ/π E + (W_c ρ F_p H) · (R ρ/π E): the first bracket is (B, patches) and made once.
    """
    average, counts = block_average(views, blocks)
    frozen, transport = views.frozen, views.frozen.transport
    device = frozen.surfels.albedo.device
    weights = (average.to_scipy() @ views.operator.to_scipy()).tocsr()
    gathered = transport.gather.to_scipy()
    shaded, bounced = [], []
    for channel in range(3):
        albedo = frozen.surfels.albedo[:, channel].float().cpu().numpy()
        matrix = (weights @ scipy.sparse.diags(albedo)).tocsr()
        shaded.append(SparseOperator.from_scipy(matrix, device))
        if interreflection:
            seen = torch.from_numpy((matrix @ gathered).toarray()).to(transport.inverse)
            bounced.append(seen @ transport.inverse[channel])
    return BlockModel(average, counts, weights, tuple(shaded), tuple(bounced))


def coarse_images(views: PreparedViews, dictionary: LightDictionary, *, interreflection: bool = True) -> CoarseImages:
    """Coarse images of all candidates by products of small matrices, instead of one rendering each."""
    model = block_model(views, interreflection=interreflection)
    frozen = views.frozen
    device = dictionary.irradiance.device
    images = torch.empty((len(dictionary), len(model.counts), 3), dtype=torch.float32, device=device)
    for channel in range(3):
        image = model.shaded[channel] @ (dictionary.irradiance.T / math.pi)
        if interreflection:
            image = image + model.bounced[channel] @ patch_radiance(frozen, dictionary, channel)
        images[:, :, channel] = image.T
    return CoarseImages(model.blocks, model.counts, images, dictionary.positions)


def block_average(views: PreparedViews, blocks: int = BLOCKS) -> tuple[SparseOperator, Tensor]:
    """The operator from used pixels (P) to blocks that hold any (B), and how many each holds (B,).

    Args:
        blocks: at most so many along each side of a view.
    """
    labels, offset = [], 0
    for view in views.views:
        height, width = view.camera.height, view.camera.width
        rows, columns = min(blocks, height), min(blocks, width)
        row = np.arange(height) * rows // height
        column = np.arange(width) * columns // width
        labels.append((offset + row[:, None] * columns + column).reshape(-1))
        offset += rows * columns
    used = np.concatenate(labels)[views.pixels.cpu().numpy()]
    _, block, counts = np.unique(used, return_inverse=True, return_counts=True)
    values = 1.0 / counts[block]
    matrix = scipy.sparse.csr_matrix((values, (block, np.arange(len(block)))), shape=(len(counts), len(block)))
    return SparseOperator.from_scipy(matrix, views.operator.matrix.device), torch.from_numpy(counts).double()
