"""How noisy a depth map is, told from the map alone."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import convolve1d

#: Standard deviation of normal noise over the median of its absolute value.
MEDIAN_TO_DEVIATION = 1.4826
#: Of the second difference along rows of the second difference along columns, of unit noise: (1² + 2² + 1²).
GAIN = 6.0


def relative_noise(depth: np.ndarray) -> float:
    """Standard deviation of a depth over the depth, for noise that is independent from pixel to pixel.

    Second differences of the inverse depth, along rows of those along columns (Immerkær 1996), vanish on planes and
    on surfaces that curve along rows or columns, and their median takes no notice of edges.

    Args:
        depth: (H, W) planar depth; what is not finite is left out with its neighbours.

    Returns:
        0 when no 3 × 3 pixels in a row are known.
    """
    known = np.isfinite(depth)
    inverse = np.where(known, 1.0 / np.where(known, depth, 1.0), np.nan)
    twice = inverse
    for axis in (0, 1):
        twice = convolve1d(twice, np.array([1.0, -2.0, 1.0]), axis, mode="constant", cval=np.nan)
    ratio = np.abs(twice[known] / inverse[known])
    ratio = ratio[np.isfinite(ratio)]
    return float(np.median(ratio)) * MEDIAN_TO_DEVIATION / GAIN if len(ratio) else 0.0
