"""Masks that may be the wrong way round."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

#: Masks that leave out more than this part of what is there may be.
MOSTLY = 0.5


def masked_out(there: Sequence[Tensor], alphas: Sequence[Tensor], what: str) -> str:
    """A line about masks that leave out most of what is there; empty if they do not.

    Args:
        there: (P,) bool of each view, its pixels that show something: where there is nothing, nothing is left out.
        alphas: (P,) of each view.
        what: what is there, in words.
    """
    kept = [alpha[shown] >= 0.5 for shown, alpha in zip(there, alphas, strict=True)]
    pixels = sum(len(part) for part in kept)
    share = 1.0 - sum(int(part.sum()) for part in kept) / max(pixels, 1)
    if not pixels or share <= MOSTLY:
        return ""
    return (
        f"masks or alpha leave out {100 * share:.0f} % of {what}. What is black in a mask does not count: if it is "
        "meant the other way round, invert the masks."
    )
