"""Surfaces that no camera saw, while the albedo is solved: each is of one colour, about that of what it touches."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.guesses import GuessedSurfaces
from rgspipe.scene.surfels import Surfels


class Ties:
    """Each guessed surface has one albedo, each other surfel its own: N surfels, M ≤ N unknowns.

    What a guessed surface does to images it does by the light that it sends back, which hardly tells its parts apart;
    each on its own they would end as black and white patches. What it goes on from, in its plane, around a bend or
    across an edge, is what it is expected to be like, within what these differ by.
    """

    def __init__(self, surfels: Surfels) -> None:
        self._surfaces = GuessedSurfaces.of(surfels)
        label = self._surfaces.labels.cpu().numpy()
        own = label < 0
        unknown = np.empty(len(label), dtype=np.int64)
        unknown[own] = np.arange(own.sum())
        unknown[~own] = own.sum() + label[~own]
        rows, count = np.arange(len(label)), int(unknown.max(initial=-1)) + 1
        spread = scipy.sparse.csr_matrix((np.ones(len(label)), (rows, unknown)), shape=(len(label), count))
        self._members = torch.from_numpy(np.bincount(unknown, minlength=count)).float()[:, None]
        self._spread = SparseOperator.from_scipy(spread, surfels.centers.device)

    def spread(self, unknowns: Tensor) -> Tensor:
        """(N, C) values of the surfels from (M, C) unknowns."""
        return self._spread.matrix @ unknowns

    def summed(self, values: Tensor) -> Tensor:
        """(M, C) the transpose of `spread`: sums of (N, C) values over what is tied."""
        return self._spread.transposed @ values

    def started(self, albedo: Tensor) -> Tensor:
        """(N, 3) albedo with what is expected of guessed surfaces, or their mean, in its place."""
        even = self.spread(self.summed(albedo) / self._members.to(albedo))
        expected, _ = self._surfaces.expected(albedo)
        return torch.where(expected.isfinite(), expected, even)

    def once(self, weight: Tensor) -> Tensor:
        """(N, 1) weights that add up to one surfel's (N, 1) over each guessed surface, which is one unknown."""
        return weight / self.spread(self._members.to(weight))

    def expected(self, albedo: Tensor) -> tuple[Tensor, Tensor]:
        """(N, 3) albedo that guessed surfels should have if others have `albedo` (N, 3), and (N, 1) its variance.

        Where nothing is expected the variance is infinite.
        """
        found, doubt = self._surfaces.expected(albedo)
        variance = (doubt * found.mean(dim=1, keepdim=True)).square()
        known = found.isfinite().all(dim=1, keepdim=True)
        return torch.where(known, found, 0.0), torch.where(known, variance, torch.inf)
