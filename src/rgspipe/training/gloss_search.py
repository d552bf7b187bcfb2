"""Where a lobe pays: surfaces whose highlights are explained in views that the lobe was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from rgspipe.progress import progress_bar
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.scene.surfels import Surfels
from rgspipe.training.gloss_model import GlossLight, Reflection
from rgspipe.training.gloss_solve import GlossProblem
from rgspipe.training.likeness import nearest_surfels
from rgspipe.training.view_model import LitViewModel

#: Exponents that are tried.
EXPONENTS = (5.0, 10.0, 20.0, 40.0, 80.0, 160.0)

#: Most views that lobes are fitted to and checked with, half of them each.
VIEWS = 32

#: Surfels of a patch that is decided on as a whole.
PATCH_SURFELS = 30

#: A lobe pays where the squared error of checked views falls by this part and by this part of the squared image, and
#: where views that lose do not undo more than this part of the gain.
LEAST_GAIN, LEAST_IMAGE, MOST_LOSS = 0.1, 0.02, 0.25

#: Neighbours of like colour whose errors a lobe does not raise share it: their highlights may not have been seen.
#: Those that images show less than this part of the median have no colour of their own.
LIKE_ALBEDO, LEAST_SEEN = 0.06, 0.05


def searched_views(count: int) -> list[int]:
    """Views of `count` that are looked at, spread evenly."""
    kept = min(VIEWS, count)
    return [index * count // kept for index in range(kept)]


def find_lobes(
    surfels: Surfels, problem: GlossProblem, light: GlossLight, pixel_weights: Sequence[Tensor], seed: int
) -> tuple[Tensor, Tensor]:
    """Surfels that are better described with a lobe, told by views that it was not fitted to.

    Every other view fits albedo alone, and albedo with lobes of each exponent of `EXPONENTS`; the others say in which
    patches the errors fell.

    Args:
        surfels: with the albedo that explains the views best without gloss.
        problem, light: of all surfels, `chosen` all of them.
        pixel_weights: V weights (P,) of squared errors.

    Returns:
        which (G,) int64, ascending, and ln n (G,) of the best exponent that was tried.
    """
    count, views = len(surfels), range(len(problem.models))
    fitted, checked = views[::2], views[1::2]
    labels = cluster_patches(surfels.centers, surfels.normals, max(1, count // PATCH_SURFELS), seed=seed)
    patches = torch.from_numpy(labels.astype(np.int64)).to(surfels.centers.device)
    errors = _Errors(problem.of_views(checked), light.of_views(checked), [pixel_weights[v] for v in checked], patches)
    own, held, weights = problem.of_views(fitted), light.of_views(fitted), [pixel_weights[v] for v in fitted]
    albedo = surfels.albedo.float()
    diffuse = Reflection(albedo, torch.zeros_like(albedo), torch.zeros_like(albedo[:, 0]))
    before = errors.of(own.step(held, diffuse, weights, specular=False, exponents=False))
    after = []
    for exponent in progress_bar(EXPONENTS, "gloss", unit="exponent"):
        start = replace(diffuse, log_exponents=torch.full_like(albedo[:, 0], math.log(exponent)))
        after.append(errors.of(own.step(held, start, weights, exponents=False)))
    gains = before - torch.stack(after)
    best = gains.sum(dim=1).argmax(dim=0)
    gains = gains.gather(0, best[None, None].expand(1, *before.shape))[0]
    images = errors.images()
    pays = _pays(gains, before, images)
    if bool(pays.any()):
        seen = images > LEAST_SEEN * images.median()
        pays, best = _spread(pays, best, seen & (gains.sum(dim=0) >= 0.0), patches, surfels)
    chosen = pays[patches].nonzero()[:, 0]
    return chosen, torch.tensor(EXPONENTS, device=albedo.device).log()[best][patches[chosen]]


def _pays(gains: Tensor, before: Tensor, images: Tensor) -> Tensor:
    """(C,) bool of patches whose squared errors (V, C) fell by `gains` (V, C); `images` are squares (C,) themselves."""
    total, lost = gains.sum(dim=0), (-gains).clamp(min=0.0).sum(dim=0)
    enough = (total > LEAST_GAIN * before.sum(dim=0)) & (total > LEAST_IMAGE * images)
    return enough & (lost < MOST_LOSS * (total + lost))


def _spread(pays: Tensor, best: Tensor, harmless: Tensor, patches: Tensor, surfels: Surfels) -> tuple[Tensor, Tensor]:
    """Patches (C,) that pay, or are `harmless`, touch such a one and have its colour; and the exponents with it."""
    count, members = len(pays), torch.bincount(patches)[:, None]
    albedo, places = (
        members.new_zeros(count, 3, dtype=torch.float32).index_add(0, patches, part.float()) / members
        for part in (surfels.albedo, surfels.centers)
    )
    near = nearest_surfels(places, albedo)
    alike = (albedo[near] - albedo[:, None]).abs().amax(dim=-1) < LIKE_ALBEDO
    while True:
        touching = alike & pays[near]
        added = ~pays & harmless & touching.any(dim=1)
        if not bool(added.any()):
            return pays, best
        source = near.gather(1, touching.long().argmax(dim=1, keepdim=True))[:, 0]
        best = torch.where(added, best[source], best)
        pays = pays | added


@dataclass(frozen=True)
class _Errors:
    """Squared errors of checked views by patch.

    Attributes:
        problem, light, weights: of the checked views.
        patches: (N,) int64 patch of each surfel.
    """

    problem: GlossProblem
    light: GlossLight
    weights: Sequence[Tensor]
    patches: Tensor

    def images(self) -> Tensor:
        """(C,) squared image of every patch, over all views."""
        return sum(self._shared(model, weight * image.square().sum(dim=1)) for model, image, weight in self._views())

    def of(self, reflection: Reflection) -> Tensor:
        """(V, C) of every view and patch."""
        renders = self.problem.images_of(self.light, reflection)
        rows = [
            self._shared(model, weight * (render - image).square().sum(dim=1))
            for (model, image, weight), render in zip(self._views(), renders, strict=True)
        ]
        return torch.stack(rows)

    def _views(self) -> Iterator[tuple[LitViewModel, Tensor, Tensor]]:
        return zip(self.problem.models, self.problem.images, self.weights, strict=True)

    def _shared(self, model: LitViewModel, values: Tensor) -> Tensor:
        """(C,) of values of pixels (P,), shared out by the weights of the patches' surfels."""
        shares = (model.weights.operator.transposed @ values[:, None])[:, 0]
        return shares.new_zeros(int(self.patches.max()) + 1).index_add(0, self.patches, shares)
