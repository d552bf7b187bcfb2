"""What is known of how a target's images were taken: exposures, clipped and rounded values, and a base."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from rgspipe.arguments import as_one_of
from rgspipe.errors import InputError
from rgspipe.options import Options, option
from rgspipe.scene import srgb
from rgspipe.scene.arrays import ArrayLike, as_tensor

#: Levels of an 8-bit image.
LEVELS = 255.0

#: How far from a level, in levels, a value may be that was stored as one.
ROUNDING = 1e-2

#: … and that is where images hold their levels: half a level below the brightest one.
SATURATED = float(srgb.decode(np.array((LEVELS - 0.5) / LEVELS)))


@dataclass(frozen=True, eq=False)
class BaseImages:
    """The same views with the lamps off, each taken with the exposure of its view and clipped where that is.

    Attributes:
        images: (H, W, 3) linear radiance per view; one stands for a list of it.
        scale_free: whether they are in the target a factor times, per colour, that is not known.
    """

    images: Sequence[ArrayLike] | ArrayLike
    scale_free: bool = False


@dataclass(frozen=True)
class ImageCapture(Options):
    """How images were taken.

    Attributes:
        exposure_free: whether every view but the first has an unknown exposure.
        clip: radiance of the brightest level of 8-bit sRGB images, at which they are clipped, or one of each view, inf
            where it is not; None for images that hold radiance as it was. Saturated values tell only that the radiance
            is at least so high.
        saturated: a value from here on, as a part of the clip, is saturated.
        base: what was there anyway; nothing if None.

    Raises:
        InputError: neither exposures nor the factor of the base are known; or a number that cannot be.
    """

    exposure_free: bool = False
    clip: float | Sequence[float] | None = None
    saturated: float = option(SATURATED, low=1e-9, high=1)
    """a value from here on, as a part of the clip, is saturated"""
    base: BaseImages | None = None

    def clips(self, count: int) -> Tensor:
        """(count,) float64 radiance at which each view is clipped; inf where it is not.

        Raises:
            InputError: it is known of another number of views.
        """
        found = torch.tensor(math.inf).double() if self.clip is None else _limits(self.clip)
        if found.dim() and len(found) != count:
            expected, remedy = f"one number, or {count}, as there are views", "Give inf for views that are not clipped."
            raise InputError("clip", expected=expected, found=f"{len(found)}", remedy=remedy)
        return found.expand(count)

    def check(self) -> None:
        """Refuse clips that are none, a base that is none, and unknowns that do not go together.

        Raises:
            InputError: says which.
        """
        if self.clip is not None and not bool((_limits(self.clip) > 0.0).all()):
            expected, found = "radiance above 0", f"{self.clip}"[:80]
            raise InputError("clip", expected=expected, found=found, remedy="None is for images that are not clipped.")
        if self.base is not None:
            as_one_of(self.base, BaseImages, "base", "Pass BaseImages([image, …]).")
        if self.exposure_free and self.base is not None and self.base.scale_free:
            raise InputError(
                "base",
                expected="images in the exposures of their views, where exposures are free",
                found="an unknown factor besides",
                remedy="Take target and base with the same settings of the camera, and say that the factor is known.",
            )


def _limits(clip: ArrayLike) -> Tensor:
    """() or (V,) float64.

    Raises:
        InputError: no number, nor a list of them.
    """
    return as_tensor(clip, "clip", () if np.ndim(clip) == 0 else ("V",), torch.float64)


def stored_in_eight_bits(image: Tensor, alpha: Tensor) -> bool:
    """Whether an image (H, W, 3) holds nothing but the 256 levels of sRGB between 0 and 1, where alpha (H, W) is 1."""
    values = image[alpha >= 1.0].double()
    if not values.numel() or not bool((values <= 1.0).all()) or not bool((values > 0.0).any()):
        return False
    levels = torch.from_numpy(LEVELS * srgb.encode(values.numpy()))
    return bool(((levels - levels.round()).abs() < ROUNDING).all())


def rounding_noise(values: Tensor, clip: Tensor) -> Tensor:
    """Standard deviation of the rounding of values (…) of 8-bit sRGB images that are clipped at `clip` (…).

    A level is a step of dL/dE / 255 at the value's place on the curve, and the error is uniform within it. Images that
    are not clipped, at inf, are not rounded.
    """
    share = (values.double() / clip).clamp(0.0, 1.0)
    slope = torch.where(share <= 0.0031308, 1.0 / 12.92, 2.4 / 1.055 * share.clamp(min=1e-6) ** (1.4 / 2.4))
    return torch.where(clip < math.inf, clip, 0.0) * slope / LEVELS / math.sqrt(12.0)
