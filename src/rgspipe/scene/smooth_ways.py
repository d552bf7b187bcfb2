"""Ways along smooth surfaces: what a surface that goes out of sight goes on from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

#: Surfels no farther apart than so many of their distances, and turned by less than 45°, are of one surface.
TOGETHER, TURNED = 2.0, 0.7

#: Sine of half of this turn.
HALF_TURN = math.sqrt(0.5 * (1.0 - TURNED))


@dataclass(frozen=True)
class SmoothWays:
    """Steps from surfel to surfel of one smooth surface.

    Attributes:
        steps: (N, N) their lengths, both ways.
    """

    steps: csr_matrix

    @classmethod
    def among(cls, centers: np.ndarray, normals: np.ndarray, spacing: float) -> SmoothWays:
        """Those among surfels at `centers` (N, 3) with unit `normals` (N, 3), so far apart as neighbours are."""
        pairs = cKDTree(centers).query_pairs(TOGETHER * spacing, output_type="ndarray")
        first, second = pairs.T
        away, both = centers[second] - centers[first], normals[first] + normals[second]
        length = np.linalg.norm(away, axis=1)
        # A chord is along the surface somewhere between its ends, so within half of their turn of what is half-way: of
        # two sheets one above the other neither goes on in the other.
        level = np.abs((away * both).sum(axis=1)) <= HALF_TURN * length * np.linalg.norm(both, axis=1)
        chosen = level & (length > 0.0) & ((normals[first] * normals[second]).sum(axis=1) > TURNED)
        first, second, length = first[chosen], second[chosen], length[chosen]
        ends = np.concatenate([first, second]), np.concatenate([second, first])
        return cls(csr_matrix((np.tile(length, 2), ends), shape=(len(centers), len(centers))))

    def surfaces(self, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
        """(N,) which surface of `chosen` (N,) surfels each is of; others are alone."""
        kept = self._kept(chosen, chosen)
        return connected_components(kept, directed=False)[1].astype(np.int64)

    def sources(self, seen: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """(N,) the surfel that was `seen` (N,) from which the way to one that was not is shortest, and its length.

        −1 and infinity where no way leads there, and where seen.
        """
        rim = np.flatnonzero(seen & self.lead_to(~seen))
        found, length = np.full(len(seen), -1), np.full(len(seen), np.inf)
        if len(rim):
            length, _, found = dijkstra(self._kept(None, ~seen), indices=rim, min_only=True, return_predecessors=True)
        unknown = seen | ~np.isfinite(length)
        return np.where(unknown, -1, found).astype(np.int64), np.where(unknown, np.inf, length)

    def lead_to(self, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """(N,) whether a step leads from a surfel to one of `chosen` (N,)."""
        return self.steps.sign() @ chosen.astype(np.float64) > 0.0

    def within(self, rim: np.ndarray, chosen: npt.NDArray[np.bool_], reach: float) -> npt.NDArray[np.int64]:
        """Those of `chosen` (N,) surfels to which a way of no more than `reach` leads from `rim` (R,) over such."""
        if not len(rim):
            return np.empty(0, dtype=np.int64)
        length = dijkstra(self._kept(chosen, chosen), indices=rim, min_only=True, limit=reach)
        return np.flatnonzero(chosen & np.isfinite(length))

    def _kept(self, first: npt.NDArray[np.bool_] | None, second: npt.NDArray[np.bool_]) -> csr_matrix:
        """The steps from `first` (N,), of all if None, to `second` (N,)."""
        steps = self.steps.tocoo()
        kept = second[steps.col] if first is None else first[steps.row] & second[steps.col]
        return csr_matrix((steps.data[kept], (steps.row[kept], steps.col[kept])), shape=steps.shape)
