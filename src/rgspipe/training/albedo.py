"""Albedo from images: linear least squares with the indirect light held from the round before.

With the light that reaches every surfel known, each image is linear in albedo: image_v = W_v (ρ ∘ L_v).
The indirect part of L_v depends on ρ itself and is taken from the last round; undamped, that loop
oscillates around a value that is too dark, so each round goes only part of the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.progress import track
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport, with_albedo
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels
from rgspipe.training.lighting import Lighting, total_irradiance

#: Part of the way to the least-squares solution that a round goes when light bounces.
DAMPING = 0.45

#: Conjugate-gradient steps of a round; each round starts from the last one's solution.
CG_STEPS = 6

#: Albedo stays within these: below is numerically black, above rooms that never darken.
ALBEDO_RANGE = (0.005, 0.98)

#: Weight of neighbours' likeness, of the pull to PRIOR, and the albedo step that counts as an edge.
SMOOTHNESS, PULL, PRIOR, ALBEDO_EDGE = 0.1, 0.003, 0.5, 0.08

#: Pixels with less surface than this say nothing of it.
MINIMUM_COVERAGE = 0.3


@dataclass(frozen=True)
class AlbedoProblem:
    """What stays the same over the rounds.

    Attributes:
        weights: view weights of V views.
        images: V images (pixels, 3).
        pixel_weights: V weights (pixels,) of squared errors: relative in bright pixels, absolute in dark.
        neighbours: (N, 6) nearest surfels by position and normal.
    """

    weights: Sequence[ViewWeights]
    images: Sequence[Tensor]
    pixel_weights: Sequence[Tensor]
    neighbours: Tensor

    @classmethod
    def build(cls, surfels: Surfels, weights: Sequence[ViewWeights], images: Sequence[Tensor]) -> AlbedoProblem:
        flat = [image.reshape(-1, 3).float() for image in images]
        pixel_weights = [_pixel_weight(image, view.coverage) for image, view in zip(flat, weights, strict=True)]
        return cls(weights, flat, pixel_weights, _neighbours(surfels))


def solve_albedo(
    problem: AlbedoProblem,
    surfels: Surfels,
    lighting: Lighting,
    transport: PatchTransport | None,
    rounds: int,
) -> tuple[Tensor, Tensor]:
    """Albedo (N, 3), and the total irradiance over π (V, N, 3) that belongs to it.

    Args:
        surfels: their albedo is where the rounds start.
        transport: light between surfels; None solves as if light did not bounce.
    """
    albedo = surfels.albedo.float()
    for index in track(range(rounds), "albedo", unit="round"):
        if transport is not None:
            transport = with_albedo(transport, albedo)
        total = total_irradiance(lighting, albedo, transport)
        pixel_weights = problem.pixel_weights
        if index > 0:
            pixel_weights = [_robust(problem, v, total[v] * albedo) for v in range(len(problem.images))]
        laplacian = _laplacian(problem.neighbours, surfels.normals.float(), albedo if index > 1 else None)
        solution = _least_squares(problem, pixel_weights, total, laplacian, albedo).clamp(*ALBEDO_RANGE)
        step = DAMPING if transport is not None else 1.0
        albedo = (1.0 - step) * albedo + step * solution
    if transport is not None:
        transport = with_albedo(transport, albedo)
    return albedo, total_irradiance(lighting, albedo, transport)


def _least_squares(
    problem: AlbedoProblem, pixel_weights: Sequence[Tensor], total: Tensor, laplacian: SparseOperator, start: Tensor
) -> Tensor:
    """A few preconditioned conjugate-gradient steps on the normal equations, each channel on its own."""
    right = torch.zeros_like(start)
    diagonal = torch.zeros_like(start)
    for v, view in enumerate(problem.weights):
        transposed, weight = view.operator.transposed, pixel_weights[v][:, None]
        right += total[v] * (transposed @ (weight * problem.images[v]))
        diagonal += total[v].square() * (_squared(transposed) @ weight)
    scale = float(diagonal[diagonal > 0].median()) if bool((diagonal > 0).any()) else 1.0
    pull, smooth = PULL * scale, SMOOTHNESS * scale

    def normal_operator(x: Tensor) -> Tensor:
        result = pull * x + smooth * (laplacian.matrix @ x)
        for v, view in enumerate(problem.weights):
            seen = pixel_weights[v][:, None] * (view.operator.matrix @ (total[v] * x))
            result += total[v] * (view.operator.transposed @ seen)
        return result

    precondition = 1.0 / (diagonal + pull + smooth * laplacian.diagonal()[:, None])
    return _conjugate_gradients(normal_operator, right + pull * PRIOR, precondition, start)


def _conjugate_gradients(operator, right: Tensor, precondition: Tensor, x: Tensor) -> Tensor:
    residual = right - operator(x)
    z = precondition * residual
    direction, energy = z, (residual * z).sum(dim=0)
    for _ in range(CG_STEPS):
        image = operator(direction)
        step = energy / (direction * image).sum(dim=0).clamp(min=1e-30)
        x = x + step * direction
        residual = residual - step * image
        z = precondition * residual
        renewed = (residual * z).sum(dim=0)
        direction = z + renewed / energy.clamp(min=1e-30) * direction
        energy = renewed
    return x


def _pixel_weight(image: Tensor, coverage: Tensor) -> Tensor:
    peak = torch.quantile(image, 0.99).clamp(min=1e-12)
    weight = 1.0 / (image.mean(dim=1) / peak + 0.1) / peak.square()
    return torch.where(coverage >= MINIMUM_COVERAGE, weight, torch.zeros_like(weight))


def _robust(problem: AlbedoProblem, v: int, radiance: Tensor) -> Tensor:
    """Pixel weights of view v with those that fit badly (shadow edges, occlusions) weighing less."""
    image, weight = problem.images[v], problem.pixel_weights[v]
    error = (problem.weights[v].operator.matrix @ radiance - image).abs().mean(dim=1)
    relative = error / (image.mean(dim=1) + 0.1 * torch.quantile(image, 0.99)).clamp(min=1e-12)
    used = weight > 0
    typical = 3.0 * relative[used].median() + 1e-4 if bool(used.any()) else torch.tensor(1.0)
    return weight / (1.0 + (relative / typical).square())


def _squared(matrix: Tensor) -> Tensor:
    return torch.sparse_csr_tensor(
        matrix.crow_indices(), matrix.col_indices(), matrix.values().square(), size=matrix.shape, check_invariants=False
    )


def _neighbours(surfels: Surfels) -> Tensor:
    size = float((surfels.centers.amax(dim=0) - surfels.centers.amin(dim=0)).amax())
    features = torch.cat([surfels.centers / max(size, 1e-12), 0.5 * surfels.normals], dim=1).double().cpu().numpy()
    count = min(7, len(features))
    return torch.from_numpy(cKDTree(features).query(features, k=count, workers=-1)[1].reshape(len(features), -1)[:, 1:])


def _laplacian(neighbours: Tensor, normals: Tensor, albedo: Tensor | None) -> _Laplacian:
    """Graph Laplacian over neighbours on one surface; neighbours of another colour are let go."""
    count, degree = neighbours.shape
    row, column = torch.arange(count).repeat_interleave(degree), neighbours.reshape(-1)
    weight = ((normals[row] * normals[column]).sum(dim=1) > 0.7).float()
    if albedo is not None:
        weight = weight / (1.0 + ((albedo[row] - albedo[column]).abs().amax(dim=1) / ALBEDO_EDGE).square())
    parts = (weight.numpy(), (row.numpy(), column.numpy()))
    adjacency = scipy.sparse.coo_matrix(parts, shape=(count, count)).tocsr()
    adjacency = 0.5 * (adjacency + adjacency.T)
    degrees = np.asarray(adjacency.sum(axis=1)).ravel()
    return _Laplacian(scipy.sparse.diags(degrees) - adjacency, degrees)


class _Laplacian:
    """A symmetric operator and its diagonal."""

    def __init__(self, matrix: scipy.sparse.csr_matrix, degrees: np.ndarray) -> None:
        self.matrix = SparseOperator.from_scipy(matrix.tocsr()).matrix
        self._degrees = torch.from_numpy(degrees).float()

    def diagonal(self) -> Tensor:
        return self._degrees
