"""Albedo from images: Gauss-Newton with all bounces.

image_v = D_v (ρ ∘ I_v) + W_v (ρ ∘ L_v), see `view_model`, where L_v depends on ρ itself. Its derivative is exact, so a
few rounds arrive also where light bounces ten times, and surfaces that no image shows get the albedo that the light of
all others calls for: one for each of them, as light hardly tells their parts apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.optim.conjugate_gradients import conjugate_gradients
from rgspipe.progress import progress_bar
from rgspipe.renderer.transport import PatchTransport, with_albedo
from rgspipe.scene.surfels import Surfels
from rgspipe.training.albedo import ALBEDO_RANGE, AlbedoPrior, AlbedoProblem
from rgspipe.training.lighting import LIGHTINGS_AT_ONCE, Lighting, indirect_irradiance
from rgspipe.training.likeness import Laplacian, graph_laplacian
from rgspipe.training.ties import Ties

#: Conjugate-gradient steps of a round; each round starts from the last one's solution.
CG_STEPS = 6

#: How often a step that makes things worse is halved before the round is given up.
HALVES = 5

#: Weight of neighbours' likeness, of the pull to GREY, over the images' in the median surfel.
SMOOTHNESS, PULL, GREY = 0.1, 0.003, 0.5


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
    ties, guessed = Ties(surfels), surfels.guessed > 0.0
    at = Linearised.of(problem, lighting, ties.started(surfels.albedo.float().clamp(*ALBEDO_RANGE)), transport)
    normals, pixel_weights = surfels.normals.float(), problem.photographs.weights()
    for index in progress_bar(range(rounds), "albedo", unit="round"):
        if index > 0:
            pixel_weights = problem.photographs.robust_weights(at.renders)
        laplacian = graph_laplacian(problem.neighbours, normals, at.albedo if index > 1 else None, guessed)
        pulls = pulled_to_kin(pull(prior, at.albedo), ties, at.albedo)
        quadratic = Quadratic.of(at, pixel_weights, laplacian, pulls)
        at = no_worse(at, quadratic, quadratic.step(ties))
    return at.albedo, at.indirect


@dataclass(frozen=True)
class Linearised:
    """Images and how they change with the albedo, all bounces included.

    With E the direct irradiance over π, G the light that bounces of a direct radiosity and L = G(ρ ∘ E), a change δ of
    the albedo changes L by G(δ ∘ (E + L)): what a surface reflects more goes the way of a lamp's light.

    Attributes:
        problem: the images.
        lighting: of V views.
        albedo: (N, 3) ρ.
        transport: G at ρ; None if light does not bounce.
        indirect: (V, N, 3) L; None likewise.
        renders: V images (P, 3).
    """

    problem: AlbedoProblem
    lighting: Lighting
    albedo: Tensor
    transport: PatchTransport | None
    indirect: Tensor | None
    renders: list[Tensor]

    @classmethod
    def of(
        cls, problem: AlbedoProblem, lighting: Lighting, albedo: Tensor, transport: PatchTransport | None
    ) -> Linearised:
        """The images of a problem, linear around an albedo (N, 3)."""
        indirect = None
        if transport is not None:
            transport = with_albedo(transport, albedo)
            indirect = indirect_irradiance(lighting, albedo, transport)
        renders = [problem.render(v, albedo, indirect) for v in range(len(problem.models))]
        return cls(problem, lighting, albedo, transport, indirect, renders)

    def moved(self, change: Tensor) -> Linearised:
        """The same after a change (N, 3) of the albedo, which stays within ALBEDO_RANGE."""
        return Linearised.of(self.problem, self.lighting, (self.albedo + change).clamp(*ALBEDO_RANGE), self.transport)

    def change(self, albedo: Tensor) -> list[Tensor]:
        """V images (P, 3) by which the images change with the albedo, to first order, for a change (N, 3)."""
        models = self.problem.models
        if self.indirect is None:
            return [model.shown(albedo, None) for model in models]
        found = []
        for views in _blocks(len(models)):
            received = self._received(views)
            more = self.transport.gathered((albedo * received).permute(1, 2, 0).contiguous()).permute(2, 0, 1)
            bounced = albedo * self.indirect[views] + self.albedo * more
            found += [models[v].shown(albedo, part) for v, part in zip(views, bounced, strict=True)]
        return found

    def transposed(self, images: Sequence[Tensor]) -> Tensor:
        """(N, 3) the transpose of `change` applied to V images (P, 3)."""
        models, total = self.problem.models, torch.zeros_like(self.albedo)
        for views in _blocks(len(models)):
            direct, bounced = zip(*(models[v].shown_transposed(images[v]) for v in views), strict=True)
            total += torch.stack(direct).sum(dim=0)
            if self.indirect is not None:
                weight = torch.stack(bounced)
                back = (self.albedo * weight).permute(1, 2, 0).contiguous()
                sent = self.transport.gathered_transposed(back).permute(2, 0, 1)
                total += (self.indirect[views] * weight + self._received(views) * sent).sum(dim=0)
        return total

    def _received(self, views: Sequence[int]) -> Tensor:
        """(K, N, 3) direct and indirect irradiance over π in some views."""
        return self.lighting.of_views(views).direct() + self.indirect[views]


@dataclass(frozen=True)
class Quadratic:
    """The squared errors of images that are linear in the albedo, and what pulls at it.

    Attributes:
        at: the linear images.
        pixel_weights: V weights (P,).
        smoothness: weight of the Laplacian.
        laplacian: of the likeness of neighbours.
        weight, target: (N, 1) and (N, 3), pull.
        diagonal: (N, 3) about that of the normal equations.
    """

    at: Linearised
    pixel_weights: Sequence[Tensor]
    smoothness: float
    laplacian: Laplacian
    weight: Tensor
    target: Tensor
    diagonal: Tensor

    @classmethod
    def of(
        cls, at: Linearised, pixel_weights: Sequence[Tensor], laplacian: Laplacian, pulls: tuple[Tensor, Tensor]
    ) -> Quadratic:
        """Around linear images, with the weights and the targets (N, 3) that pull at the albedo."""
        diagonal = torch.zeros_like(at.albedo)
        for v, model in enumerate(at.problem.models):
            diagonal += model.squared(pixel_weights[v], None if at.indirect is None else at.indirect[v])
        scale = float(diagonal[diagonal > 0].median()) if bool((diagonal > 0).any()) else 1.0
        weight, target = pulls
        weight, smooth = scale * weight, SMOOTHNESS * scale
        diagonal = diagonal + weight + smooth * laplacian.diagonal()[:, None]
        return cls(at, pixel_weights, smooth, laplacian, weight, target, diagonal)

    def step(self, ties: Ties) -> Tensor:
        """(N, 3) change of the albedo by a few conjugate-gradient steps, each channel on its own."""
        at = self.at
        missing = [image - render for image, render in zip(at.problem.photographs.images, at.renders, strict=True)]
        right = at.transposed(self._weighted(missing)) + self.weight * (self.target - at.albedo)
        right = ties.summed(right - self.smoothness * (self.laplacian.matrix @ at.albedo))
        precondition = 1.0 / ties.summed(self.diagonal)
        found = conjugate_gradients(
            lambda x: ties.summed(self._normal(ties.spread(x))), right, lambda x: precondition * x, CG_STEPS
        )
        return ties.spread(found)

    def loss(self, at: Linearised) -> float:
        """What is minimised, at another albedo and its own images; float64."""
        squared = zip(self.pixel_weights, self.at.problem.photographs.images, at.renders, strict=True)
        images = sum(float((w[:, None] * (a - b).square()).sum(dtype=torch.float64)) for w, a, b in squared)
        smooth = self.smoothness * float((at.albedo * (self.laplacian.matrix @ at.albedo)).sum(dtype=torch.float64))
        return images + smooth + float((self.weight * (at.albedo - self.target).square()).sum(dtype=torch.float64))

    def _normal(self, x: Tensor) -> Tensor:
        pulls = self.weight * x + self.smoothness * (self.laplacian.matrix @ x)
        return pulls + self.at.transposed(self._weighted(self.at.change(x)))

    def _weighted(self, images: Sequence[Tensor]) -> list[Tensor]:
        return [weight[:, None] * image for weight, image in zip(self.pixel_weights, images, strict=True)]


def no_worse(at: Linearised, quadratic: Quadratic, step: Tensor) -> Linearised:
    """Where a step leads, or the first of its halves that makes nothing worse; `at` if there is none."""
    before = quadratic.loss(at)
    for _ in range(HALVES):
        found = at.moved(step)
        if quadratic.loss(found) <= before:
            return found
        step = 0.5 * step
    return at


def _blocks(count: int) -> list[list[int]]:
    """0 … count − 1 in parts of LIGHTINGS_AT_ONCE."""
    return [list(range(first, min(first + LIGHTINGS_AT_ONCE, count))) for first in range(0, count, LIGHTINGS_AT_ONCE)]


def pull(prior: AlbedoPrior | None, like: Tensor) -> tuple[Tensor, Tensor]:
    """Weight (N, 1) and target (N, 3) that together stand for GREY and the prior."""
    if prior is None:
        return torch.full_like(like[:, :1], PULL), torch.full_like(like, GREY)
    weight = prior.weight.to(like)[:, None]
    return PULL + weight, (PULL * GREY + weight * prior.albedo.to(like)) / (PULL + weight)


def pulled_to_kin(pulls: tuple[Tensor, Tensor], ties: Ties, albedo: Tensor) -> tuple[Tensor, Tensor]:
    """Weights and targets, with what is expected of guessed surfaces; PULL to GREY is that of a variance of GREY²."""
    (weight, target), (expected, variance) = pulls, ties.expected(albedo)
    weight = ties.once(weight)
    more = PULL * GREY**2 / variance
    return weight + more, (weight * target + more * expected) / (weight + more)
