"""The logarithm of the albedo, as a field that is smooth along surfaces, and what is left once it is eliminated.

Each surfel's log-albedo is z = m + s, with m what was predicted (or grey) and s a Gaussian field that differs little
between neighbours of one surface:

    s ~ N(0, Q⁻¹) ,
    Q = λ Σ_(i,j) w_ij / √(h_i h_j) (e_i − e_j)(e_i − e_j)ᵀ + β Σ_i b_i b_iᵀ / h_i + diag(1 / (τ² n_i)) ,

n_i the surfels of i's surface, so that the mean of a surface has the variance τ², h_i how rough that surface is beside
the others, 1/λ twice τ² and no h where i and j are of two surfaces, which are no more alike for being even, and b_iᵀ s
what i is off the plane through its neighbours (`capture.planes`): paint that changes slowly has steps and hardly bends,
rough paint has both. What is measured of it, r = z − m + noise with the variances v_i + σ² g_i, g_i the grain of the
surface, then has the covariance Σ = diag(v + σ² g) + Q⁻¹, and

    −2 log p(r) = rᵀ Σ⁻¹ r + log det Σ ,     Σ⁻¹ = D − D (D + Q)⁻¹ D ,    D = diag(1/(v + σ² g))

with one sparse factorisation. λ, β, τ, σ, h and g are found by what was measured (`capture.variances`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from rgspipe.capture.factors import Factors
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.planes import off_planes
from rgspipe.capture.side_by_side import kept_property
from rgspipe.scene.spacing import surfel_spacing
from rgspipe.scene.surfels import Surfels
from rgspipe.training.regularise import find_neighbours

#: Weight below which two neighbours are of different surfaces.
APART = 0.05

#: Difference of two predicted log-albedos at which neighbours count half as one surface.
PAINT = 0.15


@dataclass(frozen=True)
class Variances:
    """What a scene's log-albedo and its measurement vary by.

    Attributes:
        step: variance of the difference of neighbours on one surface, 1/λ.
        surface: of the mean of a surface, τ².
        noise: of a measurement beside what its pixels say, σ²: errors of the gather and of the geometry, and texture
            that is finer than surfels.
        bend: of what a surfel is off the plane through its neighbours, 1/β.
    """

    step: float = 0.03**2
    surface: float = 0.5**2
    noise: float = 0.05**2
    bend: float = 1.0


@dataclass(frozen=True, eq=False)
class Graph:
    """Neighbours on surfaces.

    Attributes:
        first, second: (E,) int64 surfels.
        weight: (E,) in [0, 1].
        surfaces: (N,) int, number of the surface that each surfel is of.
        bent: (N, N) B, what each is off the plane through its neighbours on a surface; None where that says nothing.
    """

    first: np.ndarray
    second: np.ndarray
    weight: Numbers
    surfaces: np.ndarray
    bent: sp.csr_matrix | None = None

    @classmethod
    def of(cls, surfels: Surfels, predicted: Numbers) -> Graph:
        """Of surfels that stand where they are; neighbours whose `predicted` albedo (N, 3) differs are less of one."""
        spacing = surfel_spacing(surfels.centers.cpu(), surfels.normals.cpu())
        pairs = find_neighbours(surfels.to("cpu"), spacing)
        first, second = (part.numpy() for part in (pairs.first, pairs.second))
        weight = pairs.weight.double().numpy()
        apart = np.abs(np.log(predicted[first]) - np.log(predicted[second])).max(axis=1)
        weight = weight / (1.0 + (apart / PAINT) ** 2)
        return cls._between(first, second, weight, surfels)

    @classmethod
    def _between(cls, first: np.ndarray, second: np.ndarray, weight: Numbers, surfels: Surfels) -> Graph:
        joined, count = weight > APART, len(surfels)
        adjacency = sp.coo_matrix((weight[joined], (first[joined], second[joined])), (count, count))
        labels = connected_components(adjacency, directed=False)[1]
        graph = cls(first, second, weight, labels)
        places, normals = (part.double().cpu().numpy() for part in (surfels.centers, surfels.normals))
        return replace(graph, bent=off_planes(places, normals, graph._inner_edges))

    def without(self, apart: NDArray[np.bool_], surfels: Surfels) -> Graph:
        """With the neighbours that are `apart` (E,) as none, and the surfaces that this leaves."""
        return self._between(self.first, self.second, np.where(apart, 0.0, self.weight), surfels)

    @kept_property
    def sizes(self) -> Numbers:
        """(N,) surfels of the surface that each is of."""
        return np.bincount(self.surfaces)[self.surfaces].astype(np.float64)

    def precision(self, variances: Variances, rough: Numbers | None = None) -> sp.csc_matrix:
        """(N, N) Q, of surfaces that are as `rough` (S,) as that; all alike if None."""
        (first, second, weight), count = self.edges, len(self.sizes)
        step = np.full(len(weight), variances.step)
        if rough is not None:
            own = rough[self.surfaces]
            step *= np.sqrt(own[first] * own[second])
        # Two surfaces that touch differ as surfaces do, however even each of them is.
        weight = weight / np.where(self.surfaces[first] == self.surfaces[second], step, 2.0 * variances.surface)
        diagonal = 1.0 / (variances.surface * self.sizes)
        diagonal += np.bincount(first, weight, count) + np.bincount(second, weight, count)
        every = np.arange(count)
        rows, columns = np.concatenate([first, second, every]), np.concatenate([second, first, every])
        steps = sp.csc_matrix((np.concatenate([-weight, -weight, diagonal]), (rows, columns)), (count, count))
        if self.bent is None:
            return _sorted(steps)
        own = 1.0 if rough is None else rough[self.surfaces]
        bends = sp.diags(np.ones(count) / (variances.bend * own))
        return _sorted((steps + self.bent.T @ bends @ self.bent).tocsc())

    @kept_property
    def edges(self) -> tuple[np.ndarray, np.ndarray, Numbers]:
        """(P,) pairs of neighbours, each once, and w_ij."""
        count = len(self.sizes)
        one_way = sp.coo_matrix((0.5 * self.weight, (self.first, self.second)), (count, count))
        pairs = sp.triu(one_way + one_way.T, 1).tocoo()
        return pairs.row, pairs.col, pairs.data

    def bends(self, values: Numbers) -> Numbers:
        """(S,) mean of sᵀ H_k s of fields (N, K) over these, H_k = Bᵀ B of surface k."""
        if self.bent is None:
            return np.zeros(self.surfaces.max() + 1)
        squares = ((self.bent @ values) ** 2).mean(axis=1)
        return np.bincount(self.surfaces, squares)

    def steps(self, values: Numbers) -> Numbers:
        """(S,) mean of sᵀ L_k s of fields (N, K) over these, L_k the steps within surface k."""
        first, second, weight = self._inner_edges
        steps = values[first] - values[second]
        squares = weight * np.einsum("pk,pk->p", steps, steps) / values.shape[1]
        return np.bincount(self.surfaces[first], squares, minlength=self.surfaces.max() + 1)

    @kept_property
    def _inner_edges(self) -> tuple[np.ndarray, np.ndarray, Numbers]:
        first, second, weight = self.edges
        inner = self.surfaces[first] == self.surfaces[second]
        return first[inner], second[inner], weight[inner]


@dataclass(frozen=True, eq=False)
class Field:
    """The field, with measurements of some variance.

    Attributes:
        graph: of N surfels.
        measured: (N,) variance of each measurement by its pixels; infinite where there is none.
        trust: (N,) in [0, 1], what a measurement counts beside that: 0 for outliers.
        variances: of the scene.
        known: (N,) precision with which the field is known from elsewhere to be 0, or (N, 3) in each channel; None for
            not at all.
        rough, grain: (S,) h and g of each surface; None where all are alike.
        told: (N, 3) bool, channels in which there is a measurement; None where it is in all or none.
    """

    graph: Graph
    measured: Numbers
    trust: Numbers
    variances: Variances
    known: Numbers | None = None
    rough: Numbers | None = None
    grain: Numbers | None = None
    told: NDArray[np.bool_] | None = None

    @kept_property
    def channels(self) -> tuple[Field, ...]:
        """That of each channel; one for all where they do not differ."""
        elsewhere = self.known is not None and self.known.ndim > 1
        if self.told is None and not elsewhere:
            return (self,)
        trust = np.repeat(self.trust[:, None], 3, axis=1)
        trust = (trust if self.told is None else np.where(self.told, trust, 0.0)).T
        known = self.known.T if elsewhere else [self.known] * 3
        parts = tuple(replace(self, trust=own, known=k, told=None) for own, k in zip(trust, known, strict=True))
        for part in parts:
            part.__dict__["precision"] = self.precision  # the same, not made again
        return parts

    def channel(self, number: int) -> Field:
        """That of one channel."""
        return self.channels[number % len(self.channels)]

    def trusted(self, trust: Numbers) -> Field:
        """With another trust (N,)."""
        return replace(self, trust=trust)

    @kept_property
    def noise(self) -> Numbers:
        """(N,) σ² g."""
        grain = 1.0 if self.grain is None else self.grain[self.graph.surfaces]
        return self.variances.noise * grain * np.ones(len(self.measured))

    @kept_property
    def weight(self) -> Numbers:
        """(N,) diagonal of D, of surfels that any channel tells something of."""
        trust = self.trust if self.told is None else np.where(self.told.any(axis=1), self.trust, 0.0)
        return trust / (self.measured + self.noise)

    @kept_property
    def precision(self) -> sp.csc_matrix:
        """(N, N) Q."""
        return self.graph.precision(self.variances, self.rough)

    @kept_property
    def _prior(self) -> sp.csc_matrix:
        """(N, N) precision before the measurements."""
        if self.known is None:
            return self.precision
        return (self.precision + sp.diags(self.known.reshape(len(self.trust), -1).mean(axis=1))).tocsc()

    @kept_property
    def _posterior(self) -> Factors:
        return Factors((sp.diags(self.weight) + self._prior).tocsc())

    def _parts(self, residual: Numbers) -> Iterator[tuple[Field, Numbers]]:
        """The field of each channel with what of residuals (N, 3) is of it; all with the one field where it is one."""
        return zip(self.channels, np.split(residual, len(self.channels), axis=1), strict=True)

    def whitened_colours(self, residual: Numbers) -> Numbers:
        """(N, 3) Σ⁻¹ r in each channel."""
        return np.concatenate([own.whitened(part) for own, part in self._parts(residual)], axis=1)

    def mean_colours(self, residual: Numbers) -> Numbers:
        """(N, 3) the field that is most likely after residuals (N, 3)."""
        return np.concatenate([own.mean(part) for own, part in self._parts(residual)], axis=1)

    def whitened(self, residual: Numbers) -> Numbers:
        """Σ⁻¹ r of residuals (N, K) of one channel."""
        weighted = self.weight[:, None] * residual
        return weighted - self.weight[:, None] * self._posterior.solve(weighted)

    def mean(self, residual: Numbers) -> Numbers:
        """(N, K) the field that is most likely after residuals (N, K) of one channel."""
        return self._posterior.solve(self.weight[:, None] * residual)

    def draws(self, samples: int, seed: int) -> Numbers:
        """(N, samples) the field beside its mean, as it may be after the measurements."""
        return self._posterior.drawn(samples, seed)

    def draws_before(self, samples: int, seed: int) -> Numbers:
        """(N, samples) the field as it may be before the measurements, and before what is known from elsewhere."""
        return Factors(self.precision).drawn(samples, seed)

    def deviation(self, samples: int, seed: int) -> Numbers:
        """(N,) standard deviation of the field after the measurements, by draws of it in every channel."""
        return np.sqrt(np.mean([own.draws(samples, seed).var(axis=1) for own in self.channels], axis=0))

    def deviance(self, residual: Numbers) -> float:
        """−2 log p of residuals (N, 3), up to a constant."""
        alike = self.known is None or self.known.ndim == 1
        before = Factors(self._prior).log_determinant if alike else None
        return sum(own._deviance(part, before) for own, part in self._parts(residual))

    @property
    def measurements(self) -> int:
        """How many there are, all channels together."""
        return sum(int((own.weight > 0.0).sum()) for own in self.channels) * 3 // len(self.channels)

    def _deviance(self, residual: Numbers, before: float | None) -> float:
        """With the logarithm of the determinant of the precision before, if it is known."""
        kept = self.weight > 0.0
        determinant = self._posterior.log_determinant - np.log(self.weight[kept]).sum()
        determinant -= Factors(self._prior).log_determinant if before is None else before
        return float((residual * self.whitened(residual)).sum() + residual.shape[1] * determinant)


def _sorted(matrix: sp.csc_matrix) -> sp.csc_matrix:
    """The matrix with its entries in order: a factorisation would sort them in place, while other threads read them."""
    matrix.sum_duplicates()
    return matrix
