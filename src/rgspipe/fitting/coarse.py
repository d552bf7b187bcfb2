"""Coarse images of every candidate light, and which candidates a target looks like."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.fitting.dictionary import LightDictionary, patch_radiance
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.views import PreparedViews
from rgspipe.renderer.sparse import SparseOperator

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
    """

    blocks: SparseOperator
    counts: Tensor
    images: Tensor
    positions: Tensor


def coarse_images(views: PreparedViews, dictionary: LightDictionary, *, interreflection: bool = True) -> CoarseImages:
    """Coarse images of all candidates by products of small matrices, instead of one rendering each.

    With W_c the block averages of the view weights, and in the notation of `PatchTransport`, the image of
    channel c is W_c ρ/π E + (W_c ρ F_p H) · (R ρ/π E): the first bracket is (B, patches) and made once.
    """
    blocks, counts = block_average(views)
    frozen, transport = views.frozen, views.frozen.transport
    weights = (blocks.to_scipy() @ views.operator.to_scipy()).tocsr()
    gathered = transport.gather.to_scipy()
    images = torch.empty((len(dictionary), len(counts), 3), dtype=torch.float32, device=dictionary.irradiance.device)
    for channel in range(3):
        albedo = frozen.surfels.albedo[:, channel].float().cpu().numpy()
        shaded = (weights @ scipy.sparse.diags(albedo)).tocsr()
        image = SparseOperator.from_scipy(shaded, images.device) @ (dictionary.irradiance.T / math.pi)
        if interreflection:
            seen = torch.from_numpy((shaded @ gathered).toarray()).to(image)
            image = image + (seen @ transport.inverse[channel]) @ patch_radiance(frozen, dictionary, channel)
        images[:, :, channel] = image.T
    return CoarseImages(blocks, counts, images, dictionary.positions)


def block_average(views: PreparedViews) -> tuple[SparseOperator, Tensor]:
    """The operator from used pixels (P) to blocks that hold any (B), and how many each holds (B,)."""
    labels, offset = [], 0
    for view in views.views:
        height, width = view.camera.height, view.camera.width
        rows, columns = min(BLOCKS, height), min(BLOCKS, width)
        row = np.arange(height) * rows // height
        column = np.arange(width) * columns // width
        labels.append((offset + row[:, None] * columns + column).reshape(-1))
        offset += rows * columns
    used = np.concatenate(labels)[views.pixels.cpu().numpy()]
    _, block, counts = np.unique(used, return_inverse=True, return_counts=True)
    values = 1.0 / counts[block]
    matrix = scipy.sparse.csr_matrix((values, (block, np.arange(len(block)))), shape=(len(counts), len(block)))
    return SparseOperator.from_scipy(matrix, views.operator.matrix.device), torch.from_numpy(counts).double()


def candidate_costs(problem: LightProblem, coarse: CoarseImages) -> tuple[Tensor, Tensor]:
    """Relative squared error (C,) and best intensity ≥ 0 (C, 3) of each candidate, float64.

    Errors are relative to each block's own brightness, 1 is a candidate that explains nothing.
    """
    target = (coarse.blocks @ problem.target).double()
    weights = problem.block_weights(target, coarse.counts.to(target))
    square = torch.einsum("cbk,bk->ck", coarse.images.double().square(), weights)
    product = torch.einsum("cbk,bk->ck", coarse.images.double(), weights * target)
    energy = (weights * target.square()).sum()
    reached = square > 0
    intensity = torch.where(reached, product / torch.where(reached, square, 1.0), 0.0).clamp(min=0.0)
    explained = (2.0 * intensity * product - intensity.square() * square).sum(dim=1)
    return ((energy - explained) / energy).cpu(), intensity.cpu()


def best_candidates(costs: Tensor, positions: Tensor, count: int, separation: float) -> list[int]:
    """Indices of at most `count` candidates of least cost that are `separation` apart, best first."""
    chosen: list[int] = []
    for index in torch.argsort(costs, stable=True).tolist():
        apart = [float((positions[index] - positions[other]).norm()) > separation for other in chosen]
        if all(apart):
            chosen.append(index)
        if len(chosen) == count:
            break
    return chosen
