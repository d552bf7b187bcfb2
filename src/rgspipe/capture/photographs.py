"""Photographs as equations in the radiance of surfels, one after the other: together they may not fit into memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rgspipe.datasets.views import View
from rgspipe.fitting.model.views import LEAST_SHARE
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.view_weights import ViewWeights

Numbers = NDArray[np.float64]

#: Weight of pixels beside edges, and beside the others of saturated ones: they say where nothing else does.
LITTLE = 0.03

#: Pixels, all together, with which a photograph shows a surfel, and all photographs measure it.
SHOWN = 0.3


@dataclass(frozen=True, eq=False)
class PixelsOfView:
    """The P pixels of a photograph.

    Attributes:
        view: what was photographed.
    """

    view: View

    @property
    def image(self) -> Numbers:
        """(P, 3) linear radiance."""
        return self.view.image.reshape(-1, 3).double().numpy()

    @property
    def squared_radius(self) -> Numbers:
        """(P,) squared distance from the principal point, 1 in the farthest corner."""
        camera = self.view.camera
        x, y = np.meshgrid(np.arange(camera.width) + 0.5 - camera.cx, np.arange(camera.height) + 0.5 - camera.cy)
        squared = (x**2 + y**2).reshape(-1)
        return squared / squared.max()

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """(P, 3) where channels are saturated."""
        return self.view.saturated.reshape(-1, 3).numpy()


@dataclass(frozen=True, eq=False)
class TracedPhotograph(PixelsOfView):
    """A photograph of which was traced what its P pixels see: they are sums of the radiance of N surfels.

    Attributes:
        operator: (P, N) view weights.
        base: (P,) what pixels count before they are looked at: nothing where they are half outside of all surfaces.
    """

    operator: SparseOperator
    base: NDArray[np.float32]

    @classmethod
    def of(cls, weights: ViewWeights, view: View) -> TracedPhotograph:
        """A photograph and what its pixels see; edges count little, what is not the scene nothing."""
        whole = (weights.coverage >= LEAST_SHARE).cpu() & (view.alpha.reshape(-1) >= LEAST_SHARE)
        base = np.where(weights.edges.cpu().numpy(), LITTLE, 1.0) * whole.numpy()
        return cls(view, weights.operator, base.astype(np.float32))

    @property
    def rows(self) -> sp.csr_matrix:
        """(P, N) W, float64."""
        return self.operator.to_scipy().astype(np.float64)

    def plain(self, weight: NDArray[np.float32]) -> NDArray[np.float32]:
        """Weights (P,) of the pixels in which nothing is saturated; 0 for the others."""
        return np.where(self.saturated.any(axis=1), np.float32(0.0), weight)

    def believed(self, weight: NDArray[np.float32]) -> NDArray[np.float32]:
        """Weights (P,) with which pixels tell the radiance: little where anything is saturated."""
        return np.where(self.saturated.any(axis=1), np.float32(LITTLE), np.float32(1.0)) * weight
