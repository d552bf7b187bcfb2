"""Fit targets as a worse camera would have taken them: noise, an exposure of its own for every view, 8 bits.

Every draw comes from the seed and the target's name, so that it does not depend on which other targets are fitted.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded, eight_bit
from rgspipe.degradation.options import TargetErrors, ViewErrors


def captured(views: Sequence[View], name: str, capture: TargetErrors) -> tuple[list[View], float | None]:
    """The views of target `name` as such a camera would have taken them, and the radiance at which they are clipped.

    Radiance keeps its unit: 8-bit images are multiplied by what their brightest level stands for, which is the clip;
    None where nothing is clipped.
    """
    seed = zlib.crc32(f"{capture.seed}/{name}".encode())
    exposures = _exposures(len(views), capture.exposure, seed)
    taken = [replace(view, image=view.image * factor) for view, factor in zip(views, exposures, strict=True)]
    if capture.noise > 0.0:
        taken = list(degraded(taken, ViewErrors(image_noise=capture.noise, seed=seed)))
    if capture.white is None:
        return taken, None
    white = float(torch.cat([view.image.reshape(-1) for view in taken]).double().quantile(capture.white))
    if not white > 0.0:
        return taken, None
    return [replace(view, image=eight_bit(view.image, white)) for view in taken], white


def _exposures(count: int, stops: float, seed: int) -> list[float]:
    """A factor per view; the first is 1, so that intensities stay comparable."""
    drawn = np.random.default_rng([seed, 4]).standard_normal(count)
    return [1.0, *(math.exp(math.log(2.0) * stops * value) for value in drawn[1:])]
