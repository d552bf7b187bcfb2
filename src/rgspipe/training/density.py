"""Where surfels are: more of them where images ask for detail, none where they do nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import torch
from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import NO_CLIP, Surfels
from rgspipe.training.levels import level

#: A surfel's halves stand this many of its scales from its centre, and are this much shorter along the split. Their
#: sum differs least from the whole near these (variance along the split: 0.6² + 0.8² = 1).
APART, SHORTER = 0.6, 0.8


#: Part of the surfels that splits in a round at most, and the opacity below which a surfel is taken away.
SPLIT_SHARE, FAINTEST = 0.03, 0.03


def surfel_errors(weights: Iterable[ViewWeights], radiance: Tensor, views: Sequence[View]) -> Tensor:
    """(N,) squared error of all views, each in units of its level, shared out by the surfels' weights in the pixels.

    A saturated pixel has none where the render is at least as bright.

    Args:
        weights: of V views.
        radiance: (V, N, 3) of the surfels under the views' lights.
    """
    total = torch.zeros(radiance.shape[1], device=radiance.device)
    for weight, shown, view in zip(weights, radiance, views, strict=True):
        image = view.image.float()
        render = view.as_photographed((weight.operator @ shown).reshape(image.shape))
        error = ((render - image) / level(image, render)).square().mean(dim=2).reshape(-1, 1)
        total += (weight.operator.transposed @ error)[:, 0]
    return total


def redistributed(
    surfels: Surfels, errors: Tensor, most: int, split_share: float = SPLIT_SHARE
) -> tuple[Surfels, Tensor]:
    """Surfels (M) without the faint ones and with those of the largest errors halved, and whose part each is (M,).

    Surfels that no view sees stay: they cast shadows and send light on.

    Args:
        errors: (N,) of `surfel_errors`.
        most: surfels at the end.
        split_share: part of the surfels that splits at most.
    """
    kept = (surfels.opacities >= FAINTEST).nonzero()[:, 0]
    count = max(0, min(most - len(kept), int(split_share * len(kept))))
    # Stable, so that equal errors do not depend on the machine.
    order = errors[kept].argsort(descending=True, stable=True)[:count]
    split = kept[order[errors[kept][order] > 0.0]]
    whole = kept[~torch.isin(kept, split)]
    matt = replace(surfels, gloss=None)
    parts = [matt.selected(whole), *_halves(matt.selected(split))]
    joined = {name: torch.cat([getattr(part, name) for part in parts]) for name in surfels.tensors()}
    parent = torch.cat([whole, split, split])
    gloss = None if surfels.gloss is None else surfels.gloss.selected(parent)
    return replace(surfels, **joined, gloss=gloss), parent


def _halves(surfels: Surfels) -> tuple[Surfels, Surfels]:
    """Two surfels for each, side by side along its longer axis; edges stay where they are."""
    longer = surfels.scales.argmax(dim=1)
    chosen = torch.nn.functional.one_hot(longer, 2).to(surfels.scales)
    step = APART * chosen * surfels.scales
    shift = torch.einsum("na,nac->nc", step, surfels.frames[:, :2])
    scales = surfels.scales * (1.0 - (1.0 - SHORTER) * chosen)
    edges = torch.stack([surfels.clip_angles.cos(), surfels.clip_angles.sin()], dim=-1)
    along = torch.einsum("na,nka->nk", step, edges)

    def half(sign: float) -> Surfels:
        offsets = torch.where(
            surfels.clip_offsets >= NO_CLIP, surfels.clip_offsets, surfels.clip_offsets - sign * along
        )
        return replace(surfels, centers=surfels.centers + sign * shift, scales=scales, clip_offsets=offsets)

    return half(1.0), half(-1.0)
