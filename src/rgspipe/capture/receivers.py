"""Surfels at which light is compared: all of a scene, or of very many an even part, each for those around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp
import torch
from numpy.typing import NDArray
from torch import Tensor

from rgspipe.capture.photographs import Numbers
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.dictionary import LightDictionary, build_dictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.spacing import surfel_spacing
from rgspipe.scene.surfels import Surfels

#: Halvings after which the side of a cell is known to a millionth.
HALVINGS = 24

#: Parts of the scene, each of neighbours, whose errors are taken for independent.
PARTS = 12

#: Sets of lamps whose light is remembered: weighed anew they stand where they stood.
REMEMBERED = 6


@dataclass(frozen=True, eq=False)
class Receivers:
    """N surfels of a scene of A, at which light is compared.

    Light comes to them from all A, of which each of the N sends what those that it stands for send.

    Attributes:
        frozen: the scene; what stands in the way of light is all of it.
        stand_in: (A,) which of the N stands for each; None where they are all.
        chosen: (N,) which of the A they are, likewise.
        dictionary: unit lights on the N, where lamps may be; the scene's if None.
    """

    frozen: FrozenScene
    stand_in: NDArray[np.int64] | None = None
    chosen: NDArray[np.int64] | None = None
    dictionary: LightDictionary | None = None

    @classmethod
    def of(cls, frozen: FrozenScene, kinds: NDArray[np.int64], count: int) -> Receivers:
        """About `count` of them, evenly spread, each for those of its cell, side and kind (A,); all if there are fewer.

        The cells are cubes of a grid, and of those that one holds the nearest to their middle is taken.
        """
        if len(frozen.surfels) <= count:
            return cls(frozen)
        centers, normals = (part.double().cpu().numpy() for part in (frozen.surfels.centers, frozen.surfels.normals))
        across = np.abs(normals).argmax(axis=1)
        sides = 2 * across + (np.take_along_axis(normals, across[:, None], axis=1)[:, 0] > 0.0)

        def cells(side: float) -> NDArray[np.int64]:
            placed = np.floor((centers - centers.min(axis=0)) / side).astype(np.int64)
            return np.unique(np.column_stack([placed, sides, kinds]), axis=0, return_inverse=True)[1].ravel()

        low, high = frozen.size / count, frozen.size
        for _ in range(HALVINGS):
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if cells(middle).max() >= count else (low, middle)
        labels = cells(high)
        number = np.bincount(labels)
        means = np.stack([np.bincount(labels, column) / number for column in centers.T], axis=1)
        order = np.lexsort([((centers - means[labels]) ** 2).sum(axis=1), labels])
        return cls(frozen, labels, order[np.searchsorted(labels[order], np.arange(len(number)))])

    @property
    def are_all(self) -> bool:
        """Whether they are all of the scene's."""
        return self.chosen is None

    @cached_property
    def surfels(self) -> Surfels:
        """The N."""
        every = self.frozen.surfels
        return every if self.chosen is None else every.selected(torch.from_numpy(self.chosen))

    @cached_property
    def areas(self) -> Numbers:
        """(N,) surface that each stands for, scene units²."""
        areas = self.frozen.areas.double().cpu().numpy()
        return areas if self.stand_in is None else np.bincount(self.stand_in, areas)

    @cached_property
    def spacing(self) -> float:
        """Typical distance of neighbours, scene units."""
        return surfel_spacing(self.surfels.centers.cpu(), self.surfels.normals.cpu())

    @cached_property
    def parts(self) -> NDArray[np.integer]:
        """(N,) which of up to `PARTS` parts of the scene each surfel belongs to."""
        return cluster_patches(self.surfels.centers.double(), self.surfels.normals, PARTS, seed=0)

    def at(self, values: np.ndarray) -> np.ndarray:
        """(N, …) of values (A, …)."""
        return values if self.chosen is None else values[self.chosen]

    @cached_property
    def gather(self) -> sp.csr_matrix:
        """(N, N) F, what each gets from those that the others stand for."""
        gather = self.frozen.gather.to_scipy().astype(np.float64).tocsr()
        if self.stand_in is None:
            return gather
        every = np.arange(len(self.stand_in))
        return (gather[self.chosen] @ sp.csr_matrix((np.ones(len(every)), (every, self.stand_in)))).tocsr()

    def irradiance(self, places: Numbers, shadows: bool = True) -> tuple[Numbers, Numbers]:
        """(L, N) from unit lamps at (L, 3), and its derivative (L, N, 3)."""
        return self._irradiance(tuple(map(tuple, np.atleast_2d(places).tolist())), shadows)

    @cached_property
    def _irradiance(self) -> Callable[[tuple[tuple[float, ...], ...], bool], tuple[Numbers, Numbers]]:
        @lru_cache(maxsize=REMEMBERED)
        def found(places: tuple[tuple[float, ...], ...], shadows: bool) -> tuple[Numbers, Numbers]:
            own = self.frozen.unit_irradiance(torch.tensor(places, dtype=torch.float64), shadows, self._at)
            return own[0].double().cpu().numpy(), own[1].double().cpu().numpy()

        return found

    @property
    def _at(self) -> Tensor | None:
        return None if self.chosen is None else torch.from_numpy(self.chosen)

    def with_dictionary(self, grid: int, seed: int) -> Receivers:
        """With unit lights of their own, for which no shadow is looked for at other surfels; see `build_dictionary`."""
        scene, areas = self.frozen, torch.from_numpy(self.areas)
        made = build_dictionary(scene.bvh, areas, scene.surroundings, grid, seed=seed, at=self._at)
        return replace(self, dictionary=made)

    def candidates(self) -> tuple[Numbers, Numbers]:
        """(C, 3) places of the dictionary, and (C, N) irradiance from there."""
        own = self.dictionary
        every = self.frozen.dictionary if own is None else own
        irradiance = every.irradiance.double().cpu().numpy()
        return every.positions.double().numpy(), self.at(irradiance.T).T if own is None else irradiance
