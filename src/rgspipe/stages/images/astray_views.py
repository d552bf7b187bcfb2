"""Words about single views whose pose or depth contradicts the others."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.datasets.views import View
from rgspipe.evidence.conventions import astray


def tell_astray(views: Sequence[View], names: Sequence[str], along_rays: bool = False) -> None:
    """Warn of each; it stays in the scene, as a thing that moved looks alike.

    Args:
        names: what the views are called.
        along_rays: whether their files state depth along rays.
    """
    for one in astray(views, along_rays):
        print(
            f"warning: {names[one.index]}: {100 * one.contradicting:.0f} % of its points contradict the depth of other "
            f"views, and {100 * one.usual:.0f} % are usual here: its pose or depth is off, or something moved. Mend it "
            "or leave it out"
        )
