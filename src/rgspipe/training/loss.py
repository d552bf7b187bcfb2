"""How far a rendered image is from a photograph, for high dynamic range: in units of the view's peak, compressed."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.machine.sums import average
from rgspipe.optim.ssim import ssim_map
from rgspipe.training.options import ImageLossOptions


def compressed(values: Tensor, strength: float) -> Tensor:
    """µ-law: log(1 + µx)/log(1 + µ), odd, so that values below zero keep a gradient; x itself for µ = 0."""
    if strength == 0.0:
        return values
    return values.sign() * torch.log1p(strength * values.abs()) / math.log1p(strength)


def image_loss(rendered: Tensor, photographed: Tensor, peak: float, options: ImageLossOptions, window: bool) -> Tensor:
    """Scalar loss of pixels (P, 3), or with `window` of an image (H, W, 3).

    Args:
        peak: radiance that counts as 1.

    Raises:
        ValueError: SSIM of pixels that stand alone.
    """
    x, y = (compressed(values / peak, options.compression) for values in (rendered, photographed))
    if options.loss == "l2":
        return average((x - y).square())
    absolute = average((x - y).abs())
    if options.loss == "l1":
        return absolute
    if not window:
        raise ValueError("the loss `l1_ssim` compares windows of images, got pixels that stand alone")
    return (1.0 - options.ssim_weight) * absolute + options.ssim_weight * (1.0 - average(ssim_map(x, y)))
