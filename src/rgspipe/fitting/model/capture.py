"""What is known of how a target's images were taken: exposures, and values that are clipped and rounded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from rgspipe.scene import srgb

#: Levels of an 8-bit image.
LEVELS = 255.0

#: How far from a level, in levels, a value may be that was stored as one.
ROUNDING = 1e-2

#: … and that is where images hold their levels: half a level below the brightest one.
SATURATED = float(srgb.decode(np.array((LEVELS - 0.5) / LEVELS)))


@dataclass(frozen=True)
class ImageCapture:
    """How images were taken.

    Attributes:
        exposure_free: whether every view but the first has an unknown exposure.
        clip: radiance of the brightest level of 8-bit sRGB images, at which they are clipped; None for images that hold
            radiance as it was. Saturated values tell only that the radiance is at least so high.
        saturated: a value from here on, as a part of the clip, is saturated.
    """

    exposure_free: bool = False
    clip: float | None = None
    saturated: float = SATURATED


def stored_in_eight_bits(image: Tensor, alpha: Tensor) -> bool:
    """Whether an image (H, W, 3) holds nothing but the 256 levels of sRGB between 0 and 1, where alpha (H, W) is 1."""
    values = image[alpha >= 1.0].double()
    if not values.numel() or not bool((values <= 1.0).all()) or not bool((values > 0.0).any()):
        return False
    levels = torch.from_numpy(LEVELS * srgb.encode(values.numpy()))
    return bool(((levels - levels.round()).abs() < ROUNDING).all())


def rounding_noise(values: Tensor, clip: float) -> Tensor:
    """Standard deviation of the rounding of values (…) of 8-bit sRGB images that are clipped at `clip`.

    A level is a step of dL/dE / 255 at the value's place on the curve, and the error is uniform within it.
    """
    share = (values.double() / clip).clamp(0.0, 1.0)
    slope = torch.where(share <= 0.0031308, 1.0 / 12.92, 2.4 / 1.055 * share.clamp(min=1e-6) ** (1.4 / 2.4))
    return clip * slope / LEVELS / math.sqrt(12.0)
