"""Albedo from images: linear least squares with the indirect light held from the round before.

With the light that bounces known, each image is linear in albedo: image_v = D_v (ρ ∘ I_v) + W_v (ρ ∘ L_v), see
`view_model`. L_v depends on ρ itself and is taken from the last round; undamped, that loop oscillates around a
value that is too dark, so each round goes only part of the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.progress import progress_bar
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport, with_albedo
from rgspipe.scene.surfels import Surfels
from rgspipe.training.lighting import Lighting, indirect_irradiance
from rgspipe.training.view_model import ViewModel

#: Part of the way to the least-squares solution that a round goes when light bounces.
DAMPING = 0.45

#: Rounds that the next one is mixed from, and how little their differences may count.
MIXED, MIXING_RIDGE = 3, 1e-4

#: Conjugate-gradient steps of a round; each round starts from the last one's solution.
CG_STEPS = 6

#: Albedo stays within these: below is numerically black, above rooms that never darken.
ALBEDO_RANGE = (0.005, 0.98)

#: Weight of neighbours' likeness, of the pull to GREY, and the albedo step that counts as an edge.
SMOOTHNESS, PULL, GREY, ALBEDO_EDGE = 0.1, 0.003, 0.5, 0.08

#: Pixels with less surface than this say nothing of it.
MINIMUM_COVERAGE = 0.3

#: … and so do those whose alpha and coverage differ by more: there the surfels end where the object does not.
COVERAGE_MISMATCH = 0.1


@dataclass(frozen=True)
class AlbedoPrior:
    """What is known of the albedo before any image is explained.

    Attributes:
        albedo: (N, 3) expected.
        weight: (N,) how much it counts against the images, which weigh 1 in the median surfel; 0 for not at all.
    """

    albedo: Tensor
    weight: Tensor


@dataclass(frozen=True)
class AlbedoProblem:
    """What stays the same over the rounds.

    Attributes:
        models: of V views.
        images: V images (pixels, 3).
        pixel_weights: V weights (pixels,) of squared errors: relative in bright pixels, absolute in dark.
        neighbours: (N, 6) nearest surfels by position and normal.
    """

    models: Sequence[ViewModel]
    images: Sequence[Tensor]
    pixel_weights: Sequence[Tensor]
    neighbours: Tensor

    @classmethod
    def build(cls, surfels: Surfels, models: Sequence[ViewModel], views: Sequence[View]) -> AlbedoProblem:
        images = [view.image.reshape(-1, 3).float() for view in views]
        pairs = zip(views, models, strict=True)
        pixel_weights = [pixel_weight(view, model.weights.coverage) for view, model in pairs]
        return cls(models, images, pixel_weights, nearest_surfels(surfels.centers, surfels.normals))

    def render(self, v: int, albedo: Tensor, indirect: Tensor | None) -> Tensor:
        """(pixels, 3) view v under `indirect` (V, N, 3)."""
        return self.models[v].image(albedo, _of_view(indirect, v))


def solve_albedo(
    problem: AlbedoProblem,
    surfels: Surfels,
    lighting: Lighting,
    transport: PatchTransport | None,
    rounds: int,
    prior: AlbedoPrior | None = None,
) -> tuple[Tensor, Tensor | None]:
    """Albedo (N, 3), and the indirect irradiance over π (V, N, 3) that belongs to it; None without a transport.

    Args:
        surfels: their albedo is where the rounds start.
        transport: light between surfels; None solves as if light did not bounce.
        prior: pulls towards known albedo.
    """
    albedo = surfels.albedo.float()
    indirect, mixing = None, Mixing(DAMPING if transport is not None else 1.0)
    for index in progress_bar(range(rounds), "albedo", unit="round"):
        if transport is not None:
            transport = with_albedo(transport, albedo)
            indirect = indirect_irradiance(lighting, albedo, transport)
        pixel_weights = problem.pixel_weights
        if index > 0:
            renders = [problem.render(v, albedo, indirect) for v in range(len(problem.images))]
            pixel_weights = robust_weights(problem.images, problem.pixel_weights, renders)
        laplacian = graph_laplacian(problem.neighbours, surfels.normals.float(), albedo if index > 1 else None)
        solution = _least_squares(problem, pixel_weights, indirect, laplacian, albedo, prior).clamp(*ALBEDO_RANGE)
        albedo = mixing.next(albedo, solution).clamp(*ALBEDO_RANGE)
    if transport is not None:
        indirect = indirect_irradiance(lighting, albedo, with_albedo(transport, albedo))
    return albedo, indirect


class Mixing:
    """The next iterate of a fixed point x = g(x), from the last few (Anderson 1965), each channel on its own.

    Args:
        step: part of the way to g(x) that is gone; alone it would be plain damping.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._pairs: list[tuple[Tensor, Tensor]] = []

    def next(self, x: Tensor, found: Tensor) -> Tensor:
        """The iterate after x (N, C), whose image g(x) is `found`."""
        self._pairs = [*self._pairs, (x, found - x)][-MIXED:]
        places, misses = (torch.stack(part, dim=-1) for part in zip(*self._pairs, strict=True))
        if len(self._pairs) == 1:
            return x + self._step * misses[..., -1]
        steps, changes = places.diff(dim=-1), misses.diff(dim=-1)
        # (C, K, K) and (C, K): what combination of the changes cancels the miss best.
        normal = torch.einsum("nck,ncl->ckl", changes, changes).double()
        right = torch.einsum("nck,nc->ck", changes, misses[..., -1]).double()
        ridge = MIXING_RIDGE * normal.diagonal(dim1=1, dim2=2).mean(dim=1)[:, None, None]
        share = torch.linalg.solve(normal + (ridge + 1e-30) * torch.eye(normal.shape[1]), right).to(x)
        change = torch.einsum("nck,ck->nc", steps + self._step * changes, share)
        return x + self._step * misses[..., -1] - change


def _least_squares(
    problem: AlbedoProblem,
    pixel_weights: Sequence[Tensor],
    indirect: Tensor | None,
    laplacian: Laplacian,
    start: Tensor,
    prior: AlbedoPrior | None,
) -> Tensor:
    """A few preconditioned conjugate-gradient steps on the normal equations, each channel on its own."""
    right, diagonal = torch.zeros_like(start), torch.zeros_like(start)
    for v, model in enumerate(problem.models):
        light = _of_view(indirect, v)
        right += model.transposed(pixel_weights[v][:, None] * problem.images[v], light)
        diagonal += model.squared(pixel_weights[v], light)
    scale = float(diagonal[diagonal > 0].median()) if bool((diagonal > 0).any()) else 1.0
    weight, target = pull(prior, start)
    weight, smooth = scale * weight, SMOOTHNESS * scale

    def normal_operator(x: Tensor) -> Tensor:
        result = weight * x + smooth * (laplacian.matrix @ x)
        for v, model in enumerate(problem.models):
            light = _of_view(indirect, v)
            result += model.transposed(pixel_weights[v][:, None] * model.image(x, light), light)
        return result

    precondition = 1.0 / (diagonal + weight + smooth * laplacian.diagonal()[:, None])
    return conjugate_gradients(normal_operator, right + weight * target, lambda x: precondition * x, start)


def pull(prior: AlbedoPrior | None, like: Tensor) -> tuple[Tensor, Tensor]:
    """Weight (N, 1) and target (N, 3) that together stand for GREY and the prior."""
    if prior is None:
        return torch.full_like(like[:, :1], PULL), torch.full_like(like, GREY)
    weight = prior.weight.to(like)[:, None]
    return PULL + weight, (PULL * GREY + weight * prior.albedo.to(like)) / (PULL + weight)


def conjugate_gradients(
    operator: Callable[[Tensor], Tensor],
    right: Tensor,
    precondition: Callable[[Tensor], Tensor],
    x: Tensor,
    steps: int = CG_STEPS,
) -> Tensor:
    """So many steps from x (M, C) towards the solution of `operator` x = `right`, each column on its own.

    Args:
        precondition: about the operator's inverse, symmetric.
    """
    residual = right - operator(x)
    z = precondition(residual)
    direction, energy = z, (residual * z).sum(dim=0)
    for _ in range(steps):
        image = operator(direction)
        step = energy / (direction * image).sum(dim=0).clamp(min=1e-30)
        x = x + step * direction
        residual = residual - step * image
        z = precondition(residual)
        renewed = (residual * z).sum(dim=0)
        direction = z + renewed / energy.clamp(min=1e-30) * direction
        energy = renewed
    return x


def _of_view(indirect: Tensor | None, v: int) -> Tensor | None:
    return None if indirect is None else indirect[v]


def pixel_weight(view: View, coverage: Tensor) -> Tensor:
    """(P,) weights; none where surfels and photograph disagree on what is covered, which is for the geometry, and
    none where the photograph is saturated."""
    image, alpha = view.image.reshape(-1, 3).float(), view.alpha.reshape(-1).float()
    peak = torch.quantile(image, 0.99).clamp(min=1e-12)
    weight = 1.0 / (image.mean(dim=1) / peak + 0.1) / peak.square()
    trusted = (coverage >= MINIMUM_COVERAGE) & ((alpha - coverage).abs() <= COVERAGE_MISMATCH)
    trusted &= ~view.saturated.reshape(-1, 3).any(dim=1)
    return torch.where(trusted, weight, torch.zeros_like(weight))


def robust_weights(images: Sequence[Tensor], weights: Sequence[Tensor], renders: Sequence[Tensor]) -> list[Tensor]:
    """Pixel weights with those that fit badly (shadow edges, occlusions) weighing less."""
    return [_robust(*view) for view in zip(images, weights, renders, strict=True)]


def _robust(image: Tensor, weight: Tensor, render: Tensor) -> Tensor:
    error = (render - image).abs().mean(dim=1)
    relative = error / (image.mean(dim=1) + 0.1 * torch.quantile(image, 0.99)).clamp(min=1e-12)
    used = weight > 0
    typical = 3.0 * relative[used].median() + 1e-4 if bool(used.any()) else torch.tensor(1.0)
    return weight / (1.0 + (relative / typical).square())


def nearest_surfels(centers: Tensor, others: Tensor) -> Tensor:
    """(N, ≤ 6) int64 nearest surfels by position over the scene's size and `others` (N, 3), e.g. normals."""
    size = float((centers.amax(dim=0) - centers.amin(dim=0)).amax())
    features = torch.cat([centers / max(size, 1e-12), 0.5 * others], dim=1).double().cpu().numpy()
    count = min(7, len(features))
    return torch.from_numpy(cKDTree(features).query(features, k=count, workers=-1)[1].reshape(len(features), -1)[:, 1:])


def graph_laplacian(neighbours: Tensor, normals: Tensor | None, albedo: Tensor | None) -> Laplacian:
    """Graph Laplacian over neighbours on one surface (any if None); neighbours of another colour are let go."""
    count, degree = neighbours.shape
    row, column = torch.arange(count).repeat_interleave(degree), neighbours.reshape(-1)
    weight = torch.ones(len(row)) if normals is None else ((normals[row] * normals[column]).sum(dim=1) > 0.7).float()
    if albedo is not None:
        weight = weight / (1.0 + ((albedo[row] - albedo[column]).abs().amax(dim=1) / ALBEDO_EDGE).square())
    parts = (weight.numpy(), (row.numpy(), column.numpy()))
    adjacency = scipy.sparse.coo_matrix(parts, shape=(count, count)).tocsr()
    adjacency = 0.5 * (adjacency + adjacency.T)
    degrees = np.asarray(adjacency.sum(axis=1)).ravel()
    return Laplacian(scipy.sparse.diags(degrees) - adjacency, degrees)


class Laplacian:
    """A symmetric operator and its diagonal."""

    def __init__(self, matrix: scipy.sparse.csr_matrix, degrees: np.ndarray) -> None:
        self.sparse = matrix.tocsc()
        self.matrix = SparseOperator.from_scipy(matrix.tocsr()).matrix
        self._degrees = torch.from_numpy(degrees).float()

    def diagonal(self) -> Tensor:
        return self._degrees
