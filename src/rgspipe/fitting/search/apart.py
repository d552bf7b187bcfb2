"""Which combinations of candidates are clearly different starts: their lights stand apart, or shine elsewhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.optimize import linear_sum_assignment

from rgspipe.fitting.search.coarse import CoarseImages

#: Candidates by their indices.
Combination = tuple[int, ...]

#: Up to so many lights all ways to pair those of two rigs are tried at once.
ALL_PAIRINGS = 3


@dataclass(frozen=True)
class CandidatePlaces:
    """Where candidates stand, and where they shine.

    Attributes:
        positions: (C, 3) float64.
        axes: (C, 3) float64 unit vectors; None where they shine alike in all directions.
        spacing: between neighbouring axes [rad].
    """

    positions: np.ndarray
    axes: np.ndarray | None
    spacing: float

    @classmethod
    def of(cls, coarse: CoarseImages) -> CandidatePlaces:
        """Those whose images there are."""
        axes = None if coarse.axes is None else coarse.axes.double().cpu().numpy()
        return cls(coarse.positions.double().cpu().numpy(), axes, coarse.spacing)

    def first_apart(self, combinations: Sequence[Combination], count: int, separation: float) -> list[Combination]:
        """The first `count` combinations, of as many candidates each, that differ from all that were taken before.

        Args:
            separation: they do where a light is farther than this from its counterpart.
        """
        rows = np.array(combinations, dtype=np.int64)
        left, chosen = np.arange(len(rows)), []
        while len(left) and len(chosen) < count:
            first, left = int(left[0]), left[1:]
            chosen.append(combinations[first])
            left = left[self._differ(rows[left], rows[first], separation)]
        return chosen

    def _differ(self, rows: np.ndarray, one: np.ndarray, separation: float) -> np.ndarray:
        """(K,) bool: which of the combinations (K, n) differ from `one` (n,)."""
        between = np.linalg.norm(self.positions[rows][:, :, None] - self.positions[one], axis=-1)
        differ = _largest_of_pairs(between) > separation
        if self.axes is not None:
            cosines = self.axes[rows] @ self.axes[one].T
            differ |= (cosines.max(axis=2) < math.cos(self.spacing)).any(axis=1)
        return differ


def _largest_of_pairs(between: np.ndarray) -> np.ndarray:
    """(K,) the largest distance of a light from its counterpart, of rigs with distances (K, n, n) between lights."""
    lights = between.shape[1]
    if lights > ALL_PAIRINGS:
        return np.array([one[linear_sum_assignment(one)].max() for one in between])
    pairings = [between[:, range(lights), list(pairing)] for pairing in permutations(range(lights))]
    distances = np.stack(pairings)
    closest = distances.sum(axis=2).argmin(axis=0)
    return distances[closest, np.arange(len(between))].max(axis=1)
