"""The sRGB transfer curve (IEC 61966-2-1), both ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Levels that are looked up at a time: each takes 8 bytes meanwhile.
LOOKED_UP = 2**20


def decode(encoded: NDArray) -> NDArray:
    """Linear values of sRGB values; odd about 0, so that values outside of [0, 1] keep their order."""
    size = np.abs(encoded)
    return np.sign(encoded) * np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)


def decode_levels(levels: NDArray[np.unsignedinteger]) -> NDArray[np.float32]:
    """Linear float32 values of levels that are stored in 8 or 16 bits, the highest of which is 1: looked up."""
    most = int(np.iinfo(levels.dtype).max)
    table, linear = decode(np.arange(most + 1) / most).astype(np.float32), np.empty(levels.shape, np.float32)
    stored, found = levels.reshape(-1), linear.reshape(-1)
    for begin in range(0, len(stored), LOOKED_UP):
        part = slice(begin, begin + LOOKED_UP)
        np.take(table, stored[part], out=found[part], mode="clip")  # "raise" would make a copy
    return linear


def encode(linear: NDArray) -> NDArray:
    """sRGB values of linear values; odd about 0."""
    size = np.abs(linear)
    return np.sign(linear) * np.where(size <= 0.0031308, 12.92 * size, 1.055 * size ** (1.0 / 2.4) - 0.055)
