"""Words about views that do not go with the others, or with what is usual: they are taken all the same."""

from __future__ import annotations

from collections.abc import Sequence

import torch

from rgspipe.capture.refusals import OFF
from rgspipe.datasets.missing_files import named
from rgspipe.datasets.views import View
from rgspipe.evidence.conventions import AgainstOthers, AstrayView
from rgspipe.evidence.masks import masked_out

#: A photograph is black whose mean is below this part of the brightest one's of the same lighting.
BLACK = 1e-3


def tell_odd_views(views: Sequence[View], names: Sequence[str]) -> None:
    """Warn of photographs that are black and of masks that leave most out.

    Args:
        names: what the views are called.
    """
    for line in (_black(views, names), _masked_out(views)):
        if line:
            print(f"warning: {line}")


def tell_astray(views: Sequence[View], names: Sequence[str], along_rays: bool = False) -> None:
    """Warn of each whose pose or depth the others contradict, or that shares nothing with them.

    It stays in the scene: a thing that moved looks alike, and so does a place that no other view shows.

    Args:
        names: what the views are called.
        along_rays: whether their files state depth along rays.
    """
    others = AgainstOthers.of(views, along_rays)
    for one in others.astray:
        print(f"warning: {names[one.index]}: {_contradiction(one)}")
    for index in others.alone:
        print(
            f"warning: {names[index]}: none of its points is seen by other views, which see each other's: its pose or "
            "depth is off, or it shows what no other does. Mend it or leave it out"
        )


def _contradiction(one: AstrayView) -> str:
    return (
        f"{100 * one.contradicting:.0f} % of its points contradict the depth of other views, and "
        f"{100 * one.usual:.0f} % are usual here: its pose or depth is off, or something moved. Mend it or leave it out"
    )


def _black(views: Sequence[View], names: Sequence[str]) -> str:
    """A line about views that are black while others under the same lamps are not."""
    brightness = [float(view.image.mean() / view.alpha.mean().clamp(min=1e-6)) for view in views]
    brightest: dict[str, float] = {}
    for view, value in zip(views, brightness, strict=True):
        brightest[view.lighting] = max(value, brightest.get(view.lighting, 0.0))
    black = [
        name
        for view, name, value in zip(views, names, brightness, strict=True)
        if view.lighting != OFF and value < BLACK * brightest[view.lighting]
    ]
    if not black:
        return ""
    return (
        f"{named(black)}: black, as if no light had been on, while others are not. Photograph it again or leave it out"
    )


def _masked_out(views: Sequence[View]) -> str:
    """A line about masks that leave out most surfaces, as far as depth tells of them."""
    known = [view for view in views if view.depth is not None]
    surfaces = [~torch.isposinf(view.depth) for view in known]
    return masked_out(surfaces, [view.alpha for view in known], "the surfaces in the photographs")
