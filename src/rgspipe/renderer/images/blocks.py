"""Views as blocks of pixels: what a search looks at, some hundreds of numbers instead of tens of thousands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.images.model import ImageModel
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.kernels.lit_transmittance import LEAST_LIT
from rgspipe.renderer.lit_surfels import lit_columns
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport
from rgspipe.renderer.unit_light import UnitLight

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene

#: A view has at most this many blocks along each side.
BLOCKS = 16


@dataclass(frozen=True)
class BlockModel(ImageModel):
    """How blocks of pixels see diffuse light.

    With W_c the block averages of the view weights, and in the notation of `PatchTransport`, the image of channel c is
    W_c ρ/π E + (W_c ρ F_p H) · (R ρ/π E): the first bracket is (B, patches) and made once.

    Attributes:
        frozen: the scene.
        effects: parts of light transport.
        average: (B, P) averages the used pixels over blocks.
        counts: (B,) float64 used pixels of each block.
        view_of: (B,) int64 view of each block; blocks are in the order of views, and none reaches over two.
        weights: (B, N) block averages of the view weights.
        shaded: (3B, N) of all channels, one after the other: `weights` times albedo.
        bounced: (3, B, patches), from the patches' direct radiosity to what blocks see of it after bounces; None
            without interreflection.
    """

    frozen: FrozenScene
    effects: Effects
    average: SparseOperator
    counts: Tensor
    view_of: Tensor
    weights: scipy.sparse.csr_matrix
    shaded: SparseOperator
    bounced: Tensor | None

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def bounds(self) -> list[int]:
        """V + 1 places: view v has the blocks from bounds[v] to bounds[v + 1]."""
        views = torch.arange(int(self.view_of[-1]) + 2, device=self.view_of.device)
        return torch.searchsorted(self.view_of, views).tolist()

    def direct(self, irradiance: Tensor) -> Tensor:
        """(B, 3, K) direct radiance under K direct irradiances (N, K)."""
        seen = self.shaded @ (irradiance / math.pi)
        return seen.reshape(3, len(self), -1).transpose(0, 1)

    def columns(self, light: UnitLight) -> Tensor:
        return self.seen(lit_columns(self.frozen.bvh, light, self.effects, LEAST_LIT, few=True))

    def seen(self, irradiance: Tensor) -> Tensor:
        """(B, 3, K) radiance under K direct irradiances (N, K), with all that bounces."""
        image = self.direct(irradiance)
        if self.bounced is None:
            return image
        # The other way round, for which a product with so few columns takes four times as long: (X B)ᵀ = Bᵀ Xᵀ.
        bounced = patch_radiance(self.frozen, irradiance).transpose(1, 2) @ self.bounced.transpose(1, 2)
        return image + bounced.permute(2, 0, 1)


def patch_radiance(frozen: FrozenScene, irradiance: Tensor) -> Tensor:
    """(3, patches, K) direct radiosity, averaged over the patches, under K direct irradiances (N, K)."""
    albedo = frozen.surfels.albedo / math.pi
    return torch.stack([frozen.transport.average @ (albedo[:, channel, None] * irradiance) for channel in range(3)])


def block_model(views: ViewedPixels, blocks: int = BLOCKS, effects: Effects = ALL_EFFECTS) -> BlockModel:
    """The blocks of some views' pixels.

    Args:
        blocks: at most so many along each side of a view.
    """
    average, counts = block_average(views, blocks)
    frozen = views.frozen
    # Solvers that are no product of small matrices are left to the polish.
    transport = frozen.solver if isinstance(frozen.solver, PatchTransport) else frozen.transport
    device = frozen.surfels.albedo.device
    weights = (average.to_scipy() @ views.operator.to_scipy()).tocsr()
    albedo = frozen.surfels.albedo.float().cpu().numpy()
    shaded = [(weights @ scipy.sparse.diags(albedo[:, channel])).tocsr() for channel in range(3)]
    bounced = None
    if effects.interreflection:
        gathered = transport.gather.to_scipy()
        seen = [torch.from_numpy((matrix @ gathered).toarray()).to(transport.inverse) for matrix in shaded]
        bounced = torch.stack([part @ inverse for part, inverse in zip(seen, transport.inverse, strict=True)])
    return BlockModel(
        frozen,
        effects,
        average,
        counts,
        view_of_blocks(average, views),
        weights,
        SparseOperator.from_scipy(scipy.sparse.vstack(shaded, format="csr"), device),
        bounced,
    )


def view_of_blocks(average: SparseOperator, views: ViewedPixels) -> Tensor:
    """(B,) int64 view of each block of `average` (B, P): blocks reach over no two, so their first pixel says it."""
    matrix = average.matrix
    return views.view_of[matrix.col_indices()[matrix.crow_indices()[:-1].long()].long()]


def block_average(views: ViewedPixels, blocks: int = BLOCKS) -> tuple[SparseOperator, Tensor]:
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
    device = views.operator.matrix.device
    return SparseOperator.from_scipy(matrix, device), torch.from_numpy(counts).double().to(device)
