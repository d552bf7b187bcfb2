"""Gauss-Newton steps on albedo, specular reflectance and exponent together, the light held."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import scipy.sparse
import scipy.sparse.linalg
import torch
from torch import Tensor

from rgspipe.machine.sums import average
from rgspipe.optim.conjugate_gradients import conjugate_gradients
from rgspipe.scene.surfels import Surfels
from rgspipe.training.albedo import ALBEDO_RANGE, AlbedoPrior
from rgspipe.training.albedo_solve import SMOOTHNESS, pull
from rgspipe.training.gloss_model import EXPONENT_RANGE, GlossLight, GlossView, Reflection
from rgspipe.training.likeness import Laplacian, graph_laplacian, nearest_surfels
from rgspipe.training.view_model import LitViewModel

#: Weight of neighbours' likeness in specular reflectance and in the logarithm of the exponent, against the mean of
#: what the images say. A surfel alone sees few highlights, so these are larger than that of albedo.
SPECULAR_SMOOTHNESS, EXPONENT_SMOOTHNESS = 10.0, 30.0

#: Weight of a step's own length, which holds what no image tells of (Levenberg 1944), against the same mean.
STEP_WEIGHT = 1e-3

#: Largest change of ln n in a step.
LARGEST_STEP = 0.7

#: Conjugate-gradient steps of a Gauss-Newton step.
CG_STEPS = 10


@dataclass(frozen=True)
class GlossProblem:
    """What stays the same over the steps.

    Attributes:
        models, images: of V views, images (P, 3).
        albedo_graph, gloss_graph: (N, 6) and (G, ≤ 6) nearest surfels, of all and of those that may be glossy.
        normals: (N, 3).
        chosen: (G,) int64.
        prior: of the albedo.
    """

    models: Sequence[LitViewModel]
    images: Sequence[Tensor]
    albedo_graph: Tensor
    gloss_graph: Tensor
    normals: Tensor
    chosen: Tensor
    prior: AlbedoPrior | None = None

    @classmethod
    def build(
        cls,
        surfels: Surfels,
        models: Sequence[LitViewModel],
        images: Sequence[Tensor],
        chosen: Tensor,
        prior: AlbedoPrior | None = None,
    ) -> GlossProblem:
        """That of views, of which the surfels `chosen` (G,) may be glossy."""
        centers, normals, albedo = surfels.centers.float(), surfels.normals.float(), surfels.albedo.float()
        # A material goes on around the creases of a thing, so gloss is alike where places and colours are.
        graphs = nearest_surfels(centers, normals), nearest_surfels(centers[chosen], albedo[chosen])
        return cls(models, images, *graphs, normals, chosen, prior)

    def of_views(self, views: Sequence[int]) -> GlossProblem:
        """The same for some of the views."""
        models, images = ([part[v] for v in views] for part in (self.models, self.images))
        return replace(self, models=models, images=images)

    def images_of(self, light: GlossLight, at: Reflection) -> list[Tensor]:
        """V images (P, 3)."""
        return [GlossView.of(model, light, v, at).image(at) for v, model in enumerate(self.models)]

    def step(
        self,
        light: GlossLight,
        at: Reflection,
        pixel_weights: Sequence[Tensor],
        *,
        specular: bool = True,
        exponents: bool = True,
    ) -> Reflection:
        """The reflection after one step, within its ranges.

        Args:
            pixel_weights: V weights (P,) of squared errors.
            specular, exponents: whether they change, or the albedo alone.
        """
        views = [GlossView.of(model, light, v, at) for v, model in enumerate(self.models)]
        right, diagonal = torch.zeros_like(at.flat()), torch.zeros_like(at.flat())
        for view, image, weight in zip(views, self.images, pixel_weights, strict=True):
            right += view.transposed(weight[:, None] * (image - view.image(at))).flat()
            diagonal += view.squared(weight).flat()
        penalty = _Penalty.of(self, at, at.like(diagonal))
        held = Reflection(
            torch.ones_like(at.albedo),
            torch.full_like(at.specular, float(specular)),
            torch.full_like(at.log_exponents, float(exponents)),
        ).flat()

        def normal_operator(x: Tensor) -> Tensor:
            change = at.like(x[:, 0] * held)
            result = penalty.applied(change).flat()
            for view, weight in zip(views, pixel_weights, strict=True):
                result = result + view.transposed(weight[:, None] * view.change(change)).flat()
            return (held * result)[:, None]

        right = held * (right + penalty.slope(at).flat())
        inverse = penalty.inverse(at.like(diagonal))

        def precondition(x: Tensor) -> Tensor:
            return (held * inverse(at.like(x[:, 0])).flat())[:, None]

        step = conjugate_gradients(normal_operator, right[:, None], precondition, CG_STEPS)
        return limited(at, at.like(at.flat() + step[:, 0]), self.chosen)


def limited(before: Reflection, after: Reflection, chosen: Tensor) -> Reflection:
    """`after` with reflectances that make no energy, and exponents in their range and not too far from before."""
    albedo = after.albedo.clamp(*ALBEDO_RANGE)
    specular = torch.minimum(after.specular.clamp(min=0.0), 1.0 - albedo[chosen])
    lowest, highest = torch.tensor(EXPONENT_RANGE).log().tolist()
    moved = (after.log_exponents - before.log_exponents).clamp(-LARGEST_STEP, LARGEST_STEP)
    return Reflection(albedo, specular, (before.log_exponents + moved).clamp(lowest, highest))


@dataclass(frozen=True)
class _Penalty:
    """Quadratic terms of the normal equations that come from no image: likeness of neighbours, and the pull of albedo.

    Attributes:
        albedo, gloss: Laplacians.
        weights: of the likeness in albedo, specular reflectance and ln n.
        steps: weights of the length of a step in specular reflectance and ln n.
        weight, target: (N, 1) and (N, 3) pull of the albedo.
    """

    albedo: Laplacian
    gloss: Laplacian
    weights: tuple[float, float, float]
    steps: tuple[float, float]
    weight: Tensor
    target: Tensor

    @classmethod
    def of(cls, problem: GlossProblem, at: Reflection, diagonal: Reflection) -> _Penalty:
        albedo = graph_laplacian(problem.albedo_graph, problem.normals, at.albedo)
        gloss = graph_laplacian(problem.gloss_graph, None, at.albedo[problem.chosen])
        weight, target = pull(problem.prior, at.albedo)
        typical = _median(diagonal.albedo)
        specular, logs = (max(1e-20, float(average(part))) for part in (diagonal.specular, diagonal.log_exponents))
        weights = (SMOOTHNESS * typical, SPECULAR_SMOOTHNESS * specular, EXPONENT_SMOOTHNESS * logs)
        return cls(albedo, gloss, weights, (STEP_WEIGHT * specular, STEP_WEIGHT * logs), typical * weight, target)

    def applied(self, step: Reflection) -> Reflection:
        """Times a step."""
        parts = self._smoothed(step)
        return Reflection(
            parts.albedo + self.weight * step.albedo,
            parts.specular + self.steps[0] * step.specular,
            parts.log_exponents + self.steps[1] * step.log_exponents,
        )

    def slope(self, at: Reflection) -> Reflection:
        """Negative gradient at a reflection."""
        parts = self._smoothed(at)
        albedo = self.weight * (self.target - at.albedo) - parts.albedo
        return Reflection(albedo, -parts.specular, -parts.log_exponents)

    def inverse(self, diagonal: Reflection) -> Callable[[Reflection], Reflection]:
        """The inverse of this and a diagonal together; that of one channel stands for all of k_s."""
        albedo = 1.0 / (diagonal.albedo + self.weights[0] * self.albedo.diagonal()[:, None] + self.weight)
        specular, logs = (
            _factorised(part, weight * self.gloss.sparse)
            for part, weight in (
                (diagonal.specular.mean(dim=1) + self.steps[0], self.weights[1]),
                (diagonal.log_exponents + self.steps[1], self.weights[2]),
            )
        )
        return lambda x: Reflection(albedo * x.albedo, specular(x.specular), logs(x.log_exponents))

    def _smoothed(self, x: Reflection) -> Reflection:
        return Reflection(
            self.weights[0] * (self.albedo.matrix @ x.albedo),
            self.weights[1] * (self.gloss.matrix @ x.specular),
            self.weights[2] * (self.gloss.matrix @ x.log_exponents[:, None])[:, 0],
        )


def _factorised(diagonal: Tensor, laplacian: scipy.sparse.csc_matrix) -> Callable[[Tensor], Tensor]:
    """Solves with `diagonal` (G,) and `laplacian` (G, G) together."""
    factors = scipy.sparse.linalg.splu((scipy.sparse.diags(diagonal.double().cpu().numpy()) + laplacian).tocsc())
    return lambda x: torch.from_numpy(factors.solve(x.double().cpu().numpy())).to(x)


def _median(diagonal: Tensor) -> float:
    return float(diagonal[diagonal > 0].median()) if bool((diagonal > 0).any()) else 1.0
