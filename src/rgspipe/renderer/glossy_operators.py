"""From the gather operator to the operators that carry light to, between and from glossy surfels.

No ray is cast: F_ij says with what share of its hemisphere surfel i sees surfel j, and the direction is that between
their centres. So the operators inherit the point set and the reciprocity of the gather, and only its rows and columns
of glossy surfels are touched. Sources are averaged over the patches of the diffuse transport, directions are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import pairwise
from operator import attrgetter

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.glossy import mirrored
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spherical_harmonics import coefficient_count, real_harmonics
from rgspipe.scene.surfels import Surfels

#: Values of harmonics held at once; bounds the memory of a build to about 100 MB.
VALUES_AT_ONCE = 4_000_000

#: The sparse operators and the patches of pairs, by where they are found in GlossyOperators.
OPERATOR_NAMES = (
    "average",
    "leaving",
    "surfels.between",
    "surfels.arriving",
    "patch_leaving",
    "patches.between",
    "patches.arriving",
)
PAIR_NAMES = ("surfels.patches", "patches.patches")

#: Direction of the light between surfels i and j: (E, 3) vectors from two (E,) index tensors.
Directions = Callable[[Tensor, Tensor], Tensor]


@dataclass(frozen=True)
class Exchange:
    """Light that glossy receivers get from patches, pair by pair; a receiver is a surfel or a patch of them.

    Attributes:
        between: (pairs, P_g·K) V, radiance that the glossy surfels of a patch send to a receiver.
        arriving: (receivers·K, pairs) Q, mirrored incident light of each receiver in harmonics.
        patches: (pairs,) int64 patch of each pair.
    """

    between: SparseOperator
    arriving: SparseOperator
    patches: Tensor

    def to(self, device: torch.device | str) -> Exchange:
        """The same on another device."""
        return Exchange(self.between.to(device), self.arriving.to(device), self.patches.to(device))

    def incident(self, radiance: Tensor, coefficients: Tensor) -> Tensor:
        """(receivers·K, C) from patches with diffuse radiance (P, C) and glossy coefficients (P_g·K, C)."""
        return self.arriving @ (radiance[self.patches] + self.between @ coefficients)


@dataclass(frozen=True)
class GlossyOperators:
    """Constant operators of a scene with G glossy surfels in P_g of its P patches; K harmonics.

    Attributes:
        average: (P_g, G) R_g, averages over the glossy surfels of a patch by area.
        leaving: (N, P_g·K) S, mean radiance that each surfel receives from the glossy patches.
        surfels: what arrives at the glossy surfels.
        patch_leaving: (P, P_g·K) R S.
        patches: what arrives at the glossy patches, for the light between bounces.
    """

    average: SparseOperator
    leaving: SparseOperator
    surfels: Exchange
    patch_leaving: SparseOperator
    patches: Exchange

    def to(self, device: torch.device | str) -> GlossyOperators:
        """The same on another device."""
        return GlossyOperators(*(getattr(self, field.name).to(device) for field in fields(self)))

    @property
    def degree(self) -> int:
        """Degree of the harmonics."""
        return math.isqrt(self.leaving.shape[1] // self.average.shape[0]) - 1

    def tensors(self) -> dict[str, Tensor]:
        """All of it by name, as it is stored."""
        parts = {key: part for name in OPERATOR_NAMES for key, part in attrgetter(name)(self).tensors(name).items()}
        return parts | {name: attrgetter(name)(self) for name in PAIR_NAMES}


def build_glossy_operators(
    surfels: Surfels, glossy: Tensor, gather: SparseOperator, average: SparseOperator, degree: int
) -> GlossyOperators:
    """The operators of `surfels`.

    Args:
        glossy: (G,) int64 which surfels are glossy, G > 0.
        gather: (N, N) F. average: (P, N) R, whose patches are used.
        degree: of the harmonics.
    """
    centers, normals = surfels.centers.double().cpu(), surfels.normals.double().cpu()
    chosen, seen, patch_average = glossy.cpu().numpy(), gather.to_scipy().copy(), average.to_scipy()
    # A pair that shares no light has no direction.
    seen.eliminate_zeros()
    labels = patch_average.tocsc().indices.astype(np.int64)
    patches, slots = np.unique(labels[chosen], return_inverse=True)
    slot_of = np.zeros(len(surfels), dtype=np.int64)
    slot_of[chosen] = slots
    leaving = pair_sums(_only_columns(seen, chosen), slot_of, lambda i, j: centers[i] - centers[j], degree)
    own_centers, own_normals = centers[chosen], normals[chosen]
    incident = pair_sums(
        seen[chosen], labels, lambda g, j: mirrored(centers[j] - own_centers[g], own_normals[g]), degree
    )
    average_glossy = _group_average(patch_average, chosen, patches)
    width = len(patches) * coefficient_count(degree)
    sent = spread_columns(leaving.harmonics, leaving.rows, leaving.patches, (len(surfels), width))
    between = _between(leaving, incident, chosen, patches, width)
    coarse, coarse_between = _over_receivers(incident, between, average_glossy, slots)
    device = surfels.centers.device
    return GlossyOperators(
        SparseOperator.from_scipy(average_glossy, device),
        SparseOperator.from_scipy(sent, device),
        _exchange(incident, between, len(chosen), device),
        SparseOperator.from_scipy((patch_average @ sent).tocsr(), device),
        _exchange(coarse, coarse_between, len(patches), device),
    )


def _exchange(incident: PairSums, between: scipy.sparse.csr_matrix, receivers: int, device: torch.device) -> Exchange:
    pairs, count = incident.harmonics.shape
    spread = spread_columns(math.pi * incident.harmonics, np.arange(pairs), incident.rows, (pairs, receivers * count))
    operators = (SparseOperator.from_scipy(matrix, device) for matrix in (between, spread.T.tocsr()))
    return Exchange(*operators, torch.from_numpy(incident.patches).to(device))


def _over_receivers(
    incident: PairSums, between: scipy.sparse.csr_matrix, average: scipy.sparse.csr_matrix, slots: np.ndarray
) -> tuple[PairSums, scipy.sparse.csr_matrix]:
    """Pairs of glossy surfels and patches, and V, averaged over the surfels of each glossy patch.

    Args:
        average: (P_g, G) R_g. slots: (G,) glossy patch of each glossy surfel.
    """
    area = np.asarray(average.sum(axis=0)).ravel()[incident.rows]
    wide = int(incident.patches.max(initial=0)) + 1
    keys, group = np.unique(slots[incident.rows] * wide + incident.patches, return_inverse=True)
    pairs = len(group)
    member = scipy.sparse.csr_matrix((area, (group, np.arange(pairs))), shape=(len(keys), pairs))
    form_factors = member @ incident.form_factors
    seen = scipy.sparse.diags(1.0 / form_factors) @ member @ scipy.sparse.diags(incident.form_factors) @ between
    coarse = PairSums(keys // wide, keys % wide, form_factors, member @ incident.harmonics)
    return coarse, seen.tocsr()


def _only_columns(matrix: scipy.sparse.csr_matrix, columns: np.ndarray) -> scipy.sparse.csr_matrix:
    """`matrix` with all entries of other columns gone."""
    kept = np.zeros(matrix.shape[1], dtype=matrix.dtype)
    kept[columns] = 1.0
    result = (matrix @ scipy.sparse.diags(kept)).tocsr()
    result.eliminate_zeros()
    return result


def _between(
    leaving: PairSums, incident: PairSums, chosen: np.ndarray, patches: np.ndarray, width: int
) -> scipy.sparse.csr_matrix:
    """V: the sums of light that leaves for glossy receivers, each over the form factors of its pair."""
    wide = max(int(incident.patches.max(initial=0)), int(patches.max())) + 1
    at_gloss = np.isin(leaving.rows, chosen)
    rows, slots = np.searchsorted(chosen, leaving.rows[at_gloss]), leaving.patches[at_gloss]
    # Where F_ij is an entry, its pair is one of the incident ones.
    place = np.searchsorted(incident.rows * wide + incident.patches, rows * wide + patches[slots])
    return spread_columns(
        leaving.harmonics[at_gloss] / incident.form_factors[place][:, None], place, slots, (len(incident.rows), width)
    )


def _group_average(
    average: scipy.sparse.csr_matrix, chosen: np.ndarray, patches: np.ndarray
) -> scipy.sparse.csr_matrix:
    """R_g: the rows and columns of R that hold glossy surfels, with rows that sum to 1."""
    part = average[patches][:, chosen]
    return (scipy.sparse.diags(1.0 / np.asarray(part.sum(axis=1)).ravel()) @ part).tocsr()


@dataclass(frozen=True)
class PairSums:
    """Sums over the surfels j of a patch that surfel i sees, for all pairs of surfel i and patch that see each other.

    Attributes:
        rows, patches: (pairs,) i and patch of each pair, in this order.
        form_factors: (pairs,) Σ_j F_ij.
        harmonics: (pairs, K) Σ_j F_ij Y(direction of i and j).
    """

    rows: np.ndarray
    patches: np.ndarray
    form_factors: np.ndarray
    harmonics: np.ndarray


def pair_sums(gather: scipy.sparse.csr_matrix, labels: np.ndarray, directions: Directions, degree: int) -> PairSums:
    """Sum harmonics over the entries of (rows, N) `gather`, whose columns belong to the patches `labels` (N,)."""
    per_block = max(1, VALUES_AT_ONCE // coefficient_count(degree))
    parts = [_sums_of_rows(gather, block, labels, directions, degree) for block in _blocks(gather.indptr, per_block)]
    joined = (np.concatenate(column) for column in zip(*parts, strict=True))
    return PairSums(*joined)


def _blocks(starts: np.ndarray, most: int) -> list[tuple[int, int]]:
    """Ranges of rows with at most `most` entries each, or of one row with more; at least one range."""
    rows = len(starts) - 1
    cuts = np.searchsorted(starts, np.arange(most, int(starts[-1]) + most, most), side="right") - 1
    edges = np.unique(np.concatenate([[0], cuts, [rows]]))
    return list(pairwise(edges.tolist())) or [(0, 0)]


def _sums_of_rows(
    gather: scipy.sparse.csr_matrix, block: tuple[int, int], labels: np.ndarray, directions: Directions, degree: int
) -> tuple[np.ndarray, ...]:
    entries = gather[block[0] : block[1]].tocoo()
    rows, columns = entries.row.astype(np.int64) + block[0], entries.col.astype(np.int64)
    keys = rows * (int(labels.max(initial=0)) + 1) + labels[columns]
    order = np.argsort(keys, kind="stable")
    rows, columns, values = rows[order], columns[order], entries.data[order].astype(np.float64)
    if not len(rows):
        return rows, columns, values, np.zeros((0, coefficient_count(degree)))
    towards = torch.nn.functional.normalize(directions(torch.from_numpy(rows), torch.from_numpy(columns)), dim=-1)
    weighted = real_harmonics(towards, degree).numpy() * values[:, None]
    firsts = np.flatnonzero(np.diff(keys[order], prepend=-1))
    sums = np.add.reduceat(values, firsts), np.add.reduceat(weighted, firsts, axis=0)
    return rows[firsts], labels[columns[firsts]], *sums


def spread_columns(
    sums: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]
) -> scipy.sparse.csr_matrix:
    """Sparse matrix with the K values of each pair in one row, K columns side by side.

    Args:
        sums: (pairs, K); rows: (pairs,) in ascending order; columns: (pairs,) blocks of K columns.
        shape: rows and columns of the result.
    """
    width = sums.shape[1]
    starts = np.searchsorted(rows, np.arange(shape[0] + 1)) * width
    indices = (columns[:, None] * width + np.arange(width)).ravel()
    return scipy.sparse.csr_matrix((sums.ravel().astype(np.float32), indices, starts), shape=shape)
