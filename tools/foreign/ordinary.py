"""Photographs as most people take them: of 8 bits, exposed by the camera as it sees fit, with a sensor's depth."""

from __future__ import annotations

import numpy as np

#: Share of a photograph's values that its automatic exposure leaves below white.
BELOW_WHITE = 0.99

#: Noise of depth, as a share of it.
DEPTH_NOISE = 0.01


def developed(image: np.ndarray) -> np.ndarray:
    """(H, W, 3) sRGB levels of a linear image (H, W, 3 or more)."""
    colour = image[..., :3].astype(np.float64)
    linear = np.clip(colour / max(np.quantile(colour, BELOW_WHITE), 1e-12), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * encoded).astype(np.uint8)


def sensed(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The depth as a sensor measures it."""
    return depth * (1.0 + DEPTH_NOISE * rng.standard_normal(depth.shape))
