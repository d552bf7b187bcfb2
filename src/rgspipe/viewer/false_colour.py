"""Irradiance as colours."""

from __future__ import annotations

import matplotlib
import numpy as np
import numpy.typing as npt

from rgspipe.evaluation.images import Bytes

#: What the brightest colour stands for: this percentile of the picture, so that a lamp near a wall does not hide the
#: rest.
TOP = 98.0


def coloured(values: npt.NDArray, gain: float = 1.0) -> tuple[Bytes, float]:
    """(H, W, 3) uint8 of values (H, W), dark blue for 0; and the value of the brightest colour, `gain` times less."""
    top = (float(np.percentile(values, TOP)) or 1.0) / gain
    levels = np.clip(values / top, 0.0, 1.0)
    colours = matplotlib.colormaps["viridis"](levels)[..., :3]
    return np.round(255.0 * colours).astype(np.uint8), top
