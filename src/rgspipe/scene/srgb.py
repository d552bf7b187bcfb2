"""The sRGB transfer curve (IEC 61966-2-1), both ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def decode(encoded: NDArray) -> NDArray:
    """Linear values of sRGB values; odd about 0, so that values outside of [0, 1] keep their order."""
    size = np.abs(encoded)
    return np.sign(encoded) * np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)


def encode(linear: NDArray) -> NDArray:
    """sRGB values of linear values; odd about 0."""
    size = np.abs(linear)
    return np.sign(linear) * np.where(size <= 0.0031308, 12.92 * size, 1.055 * size ** (1.0 / 2.4) - 0.055)
