"""The logarithm of the albedo, as a field that is smooth along surfaces, and what is left once it is eliminated.

Each surfel's log-albedo is z = m + s, with m what was predicted (or grey) and s a Gaussian field that differs little
between neighbours of one surface:

    s ~ N(0, Q⁻¹) ,    Q = λ Σ_(i,j) w_ij (e_i − e_j)(e_i − e_j)ᵀ + diag(1 / (τ² n_i)) ,

n_i the surfels of i's surface, so that the mean of a surface has the variance τ². What is measured of it, r = z − m +
noise with the variances v_i + σ², then has the covariance Σ = diag(v + σ²) + Q⁻¹, and

    −2 log p(r) = rᵀ Σ⁻¹ r + log det Σ ,     Σ⁻¹ = D − D (D + Q)⁻¹ D ,    D = diag(1/(v + σ²))

with one sparse factorisation. λ, τ and σ are those that make the measured r most likely (Patterson and Thompson 1971):
variances of the scene, none of them chosen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.optimize import minimize
from scipy.sparse.csgraph import connected_components

from rgspipe.capture.photographs import Numbers
from rgspipe.capture.radiance import factorised
from rgspipe.scene.spacing import surfel_spacing
from rgspipe.scene.surfels import Surfels
from rgspipe.training.regularise import find_neighbours

#: Weight below which two neighbours are of different surfaces.
APART = 0.05

#: Difference of two predicted log-albedos at which neighbours count half as one surface.
PAINT = 0.15

#: Steps of the search for the variances; each is two factorisations.
VARIANCE_STEPS = 45


@dataclass(frozen=True)
class Variances:
    """What a scene's log-albedo and its measurement vary by.

    Attributes:
        step: variance of the difference of neighbours on one surface, 1/λ.
        surface: of the mean of a surface, τ².
        noise: of a measurement beside what its pixels say, σ²: errors of the gather and of the geometry.
    """

    step: float = 0.03**2
    surface: float = 0.5**2
    noise: float = 0.05**2


@dataclass(frozen=True, eq=False)
class Graph:
    """Neighbours on surfaces.

    Attributes:
        first, second: (E,) int64 surfels.
        weight: (E,) in [0, 1].
        surfaces: (N,) int, number of the surface that each surfel is of.
    """

    first: np.ndarray
    second: np.ndarray
    weight: Numbers
    surfaces: np.ndarray

    @classmethod
    def of(cls, surfels: Surfels, predicted: Numbers) -> Graph:
        """Of surfels that stand where they are; neighbours whose `predicted` albedo (N, 3) differs are less of one."""
        spacing = surfel_spacing(surfels.centers.cpu(), surfels.normals.cpu())
        pairs = find_neighbours(surfels.to("cpu"), spacing)
        first, second = (part.numpy() for part in (pairs.first, pairs.second))
        weight = pairs.weight.double().numpy()
        apart = np.abs(np.log(predicted[first]) - np.log(predicted[second])).max(axis=1)
        weight = weight / (1.0 + (apart / PAINT) ** 2)
        joined, count = weight > APART, len(surfels)
        adjacency = sp.coo_matrix((weight[joined], (first[joined], second[joined])), (count, count))
        labels = connected_components(adjacency, directed=False)[1]
        return cls(first, second, weight, labels)

    @cached_property
    def sizes(self) -> Numbers:
        """(N,) surfels of the surface that each is of."""
        return np.bincount(self.surfaces)[self.surfaces].astype(np.float64)

    @cached_property
    def laplacian(self) -> sp.csc_matrix:
        """(N, N) Σ w (e_i − e_j)(e_i − e_j)ᵀ."""
        count = len(self.sizes)
        one_way = sp.coo_matrix((0.5 * self.weight, (self.first, self.second)), (count, count))
        both = (one_way + one_way.T).tocsc()
        return (sp.diags(np.asarray(both.sum(axis=1)).ravel()) - both).tocsc()

    def precision(self, variances: Variances) -> sp.csc_matrix:
        """(N, N) Q."""
        alone = sp.diags(1.0 / (variances.surface * self.sizes))
        return (self.laplacian / variances.step + alone).tocsc()


@dataclass(frozen=True, eq=False)
class Field:
    """The field, with measurements of some variance.

    Attributes:
        graph: of N surfels.
        measured: (N,) variance of each measurement by its pixels; infinite where there is none.
        trust: (N,) in [0, 1], what a measurement counts beside that: 0 for outliers.
        variances: of the scene.
        known: (N,) precision with which the field is known from elsewhere to be 0; None for not at all.
    """

    graph: Graph
    measured: Numbers
    trust: Numbers
    variances: Variances
    known: Numbers | None = None

    def trusted(self, trust: Numbers) -> Field:
        """With another trust (N,)."""
        return replace(self, trust=trust)

    @cached_property
    def weight(self) -> Numbers:
        """(N,) diagonal of D."""
        return self.trust / (self.measured + self.variances.noise)

    @cached_property
    def _prior(self) -> sp.csc_matrix:
        """(N, N) precision before the measurements."""
        own = self.graph.precision(self.variances)
        return own if self.known is None else (own + sp.diags(self.known)).tocsc()

    @cached_property
    def _posterior(self) -> sp.linalg.SuperLU:
        return factorised((sp.diags(self.weight) + self._prior).tocsc())

    def whitened(self, residual: Numbers) -> Numbers:
        """Σ⁻¹ r of residuals (N, K)."""
        weighted = self.weight[:, None] * residual
        return weighted - self.weight[:, None] * self._posterior.solve(weighted)

    def mean(self, residual: Numbers) -> Numbers:
        """(N, K) the field that is most likely after residuals (N, K)."""
        return self._posterior.solve(self.weight[:, None] * residual)

    def deviation(self, samples: int, seed: int) -> Numbers:
        """(N,) standard deviation of the field after the measurements, by draws of it."""
        rng, graph, count = np.random.default_rng(seed), self.graph, len(self.weight)
        shape = (count, samples)
        drawn = np.sqrt(self.weight)[:, None] * rng.standard_normal(shape)
        alone = 1.0 / (self.variances.surface * graph.sizes) + (0.0 if self.known is None else self.known)
        drawn += np.sqrt(alone)[:, None] * rng.standard_normal(shape)
        edges = np.sqrt(0.5 * graph.weight / self.variances.step)[:, None]
        edges = edges * rng.standard_normal((len(graph.weight), samples))
        incidence = _incidence(graph)
        return self._posterior.solve(drawn + incidence.T @ edges).std(axis=1)

    def deviance(self, residual: Numbers) -> float:
        """−2 log p of residuals (N, C) of C channels, up to a constant."""
        kept = self.weight > 0.0
        determinant = _log_determinant(self._posterior) - np.log(self.weight[kept]).sum()
        determinant -= _log_determinant(factorised(self._prior))
        return float((residual * self.whitened(residual)).sum() + residual.shape[1] * determinant)

    def fitted(self, residual: Numbers) -> Field:
        """With the variances that make residuals (N, C) most likely."""
        now = self.variances
        start = np.log([now.step, now.surface, now.noise])

        def deviance(logs: Numbers) -> float:
            step, surface, noise = np.exp(np.clip(logs, np.log(1e-8), np.log(1e2)))
            return replace(self, variances=Variances(step, surface, noise)).deviance(residual)

        options = {"maxfev": VARIANCE_STEPS, "initial_simplex": start + np.vstack([np.zeros(3), 1.5 * np.eye(3)])}
        found = minimize(deviance, start, method="Nelder-Mead", options=options)
        step, surface, noise = np.exp(np.clip(found.x, np.log(1e-8), np.log(1e2))).tolist()
        return replace(self, variances=Variances(step, surface, noise))


def _incidence(graph: Graph) -> sp.csr_matrix:
    """(E, N) e_i − e_j of each pair."""
    edges, count = np.arange(len(graph.first)), len(graph.sizes)
    ones = np.ones(len(edges))
    rows, columns = np.concatenate([edges, edges]), np.concatenate([graph.first, graph.second])
    return sp.csr_matrix((np.concatenate([ones, -ones]), (rows, columns)), (len(edges), count))


def _log_determinant(factors: sp.linalg.SuperLU) -> float:
    """Of a matrix that is positive definite."""
    return float(np.log(np.abs(factors.U.diagonal())).sum())
