"""Irradiance as colours."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
import numpy.typing as npt

from rgspipe.evaluation.images import Bytes

#: What the brightest colour stands for: this percentile of the picture, so that a lamp near a wall does not hide the
#: rest.
TOP = 98.0


def coloured(values: Sequence[npt.NDArray], gain: float = 1.0) -> tuple[list[Bytes], float]:
    """(H, W, 3) uint8 of values (H, W) of pictures that are looked at together, dark blue for 0.

    Also the value of the brightest colour in all of them, `gain` times less.
    """
    top = (float(np.percentile(np.stack(values), TOP)) or 1.0) / gain
    return [_colours(np.clip(one / top, 0.0, 1.0)) for one in values], top


def scale() -> Bytes:
    """(12, 256, 3) uint8 colours from 0 to the brightest."""
    return _colours(np.tile(np.linspace(0.0, 1.0, 256), (12, 1)))


def _colours(levels: npt.NDArray) -> Bytes:
    return np.round(255.0 * matplotlib.colormaps["viridis"](levels)[..., :3]).astype(np.uint8)
