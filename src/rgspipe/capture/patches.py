"""Patches of other paint on what counts as one surface: a rug, a picture, the black inside of a fireplace.

Steps of the field within a surface are Gaussian and measurements Student's t, so that a patch which differs much from
what is around it would be taken for outliers, each of its surfels alone. So neighbours are taken apart whose measured
values z differ by more than ν of their variance, beyond which Student's t gives a step less than half of its weight.
Measurements that are much worse than most are left out of that: they would tie what is on either side of them, and take
the side of the nearest one that is sure. What that leaves of a surface beside its largest part are islands. An island
is paint where its rim is likelier than so many outliers, and a surface of its own then:

    ½ (ν + 1) Σ_i log(1 + r_i² / (ν v_i))  >  ½ (ν + 1) Σ_(i,j) c_ij log(1 + (z_i − z_j)² / (ν v_ij)) ,

i in the island, and i, j neighbours of which one or both are; r_i what its measurements are off what the rest of the
surface tells of their place, v their variances, and c_ij the numbers that a pair of neighbours holds: n surfels have as
many, and many more pairs. A compact patch has a short rim; single surfels and thin lines of them are outliers. Islands
that touch and are no paint, each for itself, are asked once more as one: dark paint is measured unevenly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.ndimage import median
from scipy.sparse.csgraph import connected_components
from scipy.special import expit

from rgspipe.capture.field import APART, Field
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.side_by_side import kept_property
from rgspipe.capture.variances import FREEDOM, with_likely_variances
from rgspipe.fitting.certainty.regions import quantile
from rgspipe.scene.surfels import Surfels

#: Median of the square of a normal number of variance 1: channels are taken to differ alike.
MIDDLE = quantile(0.5, 1)

#: A measurement is sure whose variance is no more than this times the middle one of its surface.
SURE = 4.0

#: Rounds in which the variances of surfaces with patches of their own and the outliers on them follow.
ROUNDS = 3


def with_patches(field: Field, residual: Numbers, surfels: Surfels) -> tuple[Field, Numbers]:
    """The field with patches of other paint as surfaces of their own, and what is not known by taking them for that.

    Args:
        field: with the variances and the trust that belong to it.
        residual: (N, 3) what was measured of it.
        surfels: the N that it is of.

    Returns:
        field: the same one if there are no patches.
        doubt: (N,) variance of its values by what may be paint or outliers, beside the field's own.
    """
    islands = _Islands(field, residual)
    if islands.are_paint.any():
        field = islands.apart(surfels)
        for _ in range(ROUNDS):
            field = with_likely_variances(field, residual, trusting=True)
    return field, islands.doubt


@dataclass(frozen=True, eq=False)
class _Islands:
    """The islands of a field by residuals (N, 3); number 0 is what is of none."""

    field: Field
    residual: Numbers

    @kept_property
    def are_paint(self) -> NDArray[np.bool_]:
        """(I,) bool."""
        return self._chances > 0.5

    @property
    def doubt(self) -> Numbers:
        """(N,) variance of the values of surfels that are either paint or outliers."""
        chance = self._chances[self._numbers]
        return chance * (1.0 - chance) * self._off

    def apart(self, surfels: Surfels) -> Field:
        """The field with what is paint as surfaces of their own, and all measurements trusted alike."""
        before, numbers = self.field.graph, np.where(self.are_paint[self._numbers], self._numbers, 0)
        numbers = self._with_unsure(numbers)
        graph = before.without(numbers[before.first] != numbers[before.second], surfels)
        _, one_of = np.unique(graph.surfaces, return_index=True)
        former = before.surfaces[one_of]
        rough, grain = (None if own is None else own[former] for own in (self.field.rough, self.field.grain))
        return replace(self.field, graph=graph, rough=rough, grain=grain, trust=self._measured.astype(np.float64))

    @kept_property
    def _told(self) -> NDArray[np.bool_]:
        """(N, 3) channels that are measured."""
        told = np.isfinite(self.field.measured)[:, None]
        return np.broadcast_to(told, self.residual.shape) if self.field.told is None else told & self.field.told

    @kept_property
    def _measured(self) -> NDArray[np.bool_]:
        """(N,) bool."""
        return self._told.any(axis=1)

    @kept_property
    def _sure(self) -> NDArray[np.bool_]:
        """(N,) what is measured well enough to say where paint ends: the rest would tie to what is on either side."""
        surfaces, known = self.field.graph.surfaces, self._measured
        middle = self._middle(self._variance[known], surfaces[known])
        return known & (self._variance <= SURE * middle[surfaces])

    @kept_property
    def _compared(self) -> NDArray[np.bool_]:
        """(E,) neighbours of which one channel is measured at both, and surely."""
        graph, sure = self.field.graph, self._sure
        both = sure[graph.first] & sure[graph.second]
        return self._told_at_both.any(axis=1) & both & (graph.weight > APART)

    @property
    def _told_at_both(self) -> NDArray[np.bool_]:
        """(E, 3) channels that are measured at both of two neighbours."""
        return self._told[self.field.graph.first] & self._told[self.field.graph.second]

    @kept_property
    def _variance(self) -> Numbers:
        """(N,) of the measurements, if all surfaces are alike."""
        return self.field.measured + self.field.variances.noise

    @kept_property
    def _steps(self) -> Numbers:
        """(E,) squares of measured steps over their variance, if surfaces are alike; 0 where one is not measured."""
        graph = self.field.graph
        squares = _mean((self.residual[graph.first] - self.residual[graph.second]) ** 2, self._told_at_both)
        expected = self.field.variances.step / np.maximum(graph.weight, APART)
        expected = expected + self._variance[graph.first] + self._variance[graph.second]
        return np.divide(squares, expected, out=np.zeros_like(squares), where=self._compared)

    @kept_property
    def _scale(self) -> Numbers:
        """(N,) factor of the variances of each one's surface, by the middle one of its steps: few are across a rim."""
        surfaces = self.field.graph.surfaces
        of = surfaces[self.field.graph.first][self._compared]
        count = np.bincount(of, minlength=surfaces.max() + 1)
        middle = self._middle(self._steps[self._compared], of)
        return ((FREEDOM + count * middle / MIDDLE) / (FREEDOM + count))[surfaces]

    def _middle(self, values: Numbers, of: NDArray[np.integer]) -> Numbers:
        """(S,) the middle one of `values` (K,) that belong to surfaces `of` (K,); 0 where there is none."""
        middle, some = np.zeros(self.field.graph.surfaces.max() + 1), np.unique(of)
        middle[some] = median(values, of, some) if len(some) else 0.0
        return middle

    @kept_property
    def _far(self) -> Numbers:
        """(E,) the same over ν, of surfaces as they are."""
        return self._steps / (FREEDOM * self._scale[self.field.graph.first])

    @kept_property
    def _numbers(self) -> NDArray[np.integer]:
        """(N,) the island that each is on; what touches and is no paint, each for itself, is one of uneven paint."""
        even = self._even_islands
        outliers = (even > 0) & (self._chance_of(even) <= 0.5)[even]
        touching = self._parts(outliers[self.field.graph.first] & outliers[self.field.graph.second])
        return np.unique(np.where(outliers, even.max() + 1 + touching, even), return_inverse=True)[1]

    @kept_property
    def _even_islands(self) -> NDArray[np.integer]:
        """(N,) numbers of what steps that are far cut off from the largest part of each surface; 0 for that."""
        surfaces, parts = self.field.graph.surfaces, self._parts(self._far < 1.0)
        by_size = np.argsort(np.bincount(parts)[parts], kind="stable")
        largest = np.empty(surfaces.max() + 1, dtype=parts.dtype)
        largest[surfaces[by_size]] = parts[by_size]
        numbers = np.where(self._sure & (parts != largest[surfaces]), parts + 1, 0)
        return np.unique(numbers, return_inverse=True)[1]

    def _parts(self, joined: NDArray[np.bool_]) -> NDArray[np.integer]:
        """(N,) numbers of what compared neighbours that are `joined` (E,) tie together."""
        graph, near = self.field.graph, self._compared & joined
        ones = np.ones(int(near.sum()))
        pairs = sp.coo_matrix((ones, (graph.first[near], graph.second[near])), (len(self.residual),) * 2)
        return connected_components(pairs, directed=False)[1]

    @kept_property
    def _off(self) -> Numbers:
        """(N,) squares of what measurements on islands are off what all others tell of their place; 0 elsewhere."""
        island = self._even_islands > 0
        rest = self.field.trusted(np.where(island, 0.0, self.field.trust))
        return np.where(island, _mean((self.residual - rest.mean_colours(self.residual)) ** 2, self._told), 0.0)

    @kept_property
    def _chances(self) -> Numbers:
        """(I,) that an island is paint."""
        return self._chance_of(self._numbers)

    def _chance_of(self, numbers: NDArray[np.integer]) -> Numbers:
        """(I,) that an island of those numbers (N,) is paint."""
        outliers = np.bincount(numbers, np.log1p(self._off / (FREEDOM * self._scale * self._variance)))
        chance = expit(0.5 * (FREEDOM + 1.0) * (outliers - self._steps_of(numbers, len(outliers))))
        return np.where(np.arange(len(chance)) > 0, chance, 0.0)

    def _steps_of(self, numbers: NDArray[np.integer], count: int) -> Numbers:
        """(I,) what the steps across the rim of each of `count` islands cost, and those within it."""
        graph = self.field.graph
        of, own, other = graph.surfaces[graph.first], numbers[graph.first], numbers[graph.second]
        pairs = np.maximum(np.bincount(of, 0.5 * graph.weight, graph.surfaces.max() + 1), APART)
        held = (np.bincount(graph.surfaces) / pairs)[of] * graph.weight
        # Pairs within an island are there both ways round.
        return np.bincount(own, np.where(own == other, 0.5, 1.0) * held * np.log1p(self._far), count)

    def _with_unsure(self, numbers: NDArray[np.integer]) -> NDArray[np.integer]:
        """Numbers (N,), those of what is not sure as the nearest that is has them."""
        graph, numbers, known = self.field.graph, numbers.copy(), self._sure.copy()
        order = np.argsort(graph.weight, kind="stable")
        first, second = (part[order][graph.weight[order] > APART] for part in (graph.first, graph.second))
        while (reached := ~known[first] & known[second]).any():
            numbers[first[reached]] = numbers[second[reached]]
            known[first[reached]] = True
        return numbers


def _mean(squares: Numbers, told: NDArray[np.bool_]) -> Numbers:
    """(K,) means of the channels of (K, 3) that are `told`; 0 where none is."""
    return np.where(told, squares, 0.0).sum(axis=1) / np.maximum(told.sum(axis=1), 1)
