"""A lamp whose own pixels an image shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.ndimage

Mask = npt.NDArray[np.bool_]

#: Pixels beside a lamp's that hold some of its light: filters reach so far, and edges are smoothed.
BESIDE = 2

#: Pixels that touch at a corner belong together.
TOUCHING = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class LampInSight:
    """Pixels of one view that are a lamp's own.

    Attributes:
        view: index of the view.
        core: (H, W) bool, pixels that are nothing but the lamp, or were given.
        pixels: (H, W) bool, those that are left out: `core` and what lies beside it.
        given: whether people said so.
        light: number (from 1) of the light that was found there; None if none was.
    """

    view: int
    core: Mask
    pixels: Mask
    given: bool = False
    light: int | None = None

    @property
    def place(self) -> tuple[float, float]:
        """Column and row of its middle, in pixels."""
        rows, columns = np.nonzero(self.core)
        return float(columns.mean()) + 0.5, float(rows.mean()) + 0.5

    def data(self) -> dict[str, object]:
        """As JSON holds it."""
        column, row = self.place
        size = int(self.pixels.sum())
        return {
            "view": self.view,
            "column": column,
            "row": row,
            "pixels": size,
            "given": self.given,
            "light": self.light,
        }


def parts(mask: Mask) -> list[Mask]:
    """The connected parts of a mask (H, W)."""
    labels, count = scipy.ndimage.label(mask, structure=TOUCHING)
    return [labels == label for label in range(1, count + 1)]


def grown(mask: Mask, pixels: int) -> Mask:
    """A mask (H, W) and all that is at most so many pixels away from it, straight or aslant."""
    return scipy.ndimage.binary_dilation(mask, structure=TOUCHING, iterations=pixels)


def given_lamps(masks: Sequence[npt.ArrayLike]) -> list[LampInSight]:
    """The lamps of masks (H, W) bool, one a view; nothing is added to what was given."""
    return [
        LampInSight(view, part, part, given=True)
        for view, mask in enumerate(masks)
        for part in parts(np.asarray(mask, dtype=bool))
    ]


def left_out(lamps: Sequence[LampInSight], sizes: Sequence[tuple[int, int]]) -> list[Mask]:
    """(H, W) bool a view, the pixels of any lamp.

    Args:
        sizes: H and W of each view.
    """
    masks = [np.zeros(size, dtype=bool) for size in sizes]
    for lamp in lamps:
        masks[lamp.view] |= lamp.pixels
    return masks
