"""How far a rendered image is from a photograph, for high dynamic range: in units of the view's peak, compressed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from rgspipe.optim.ssim import ssim_map

LossKind = Literal["l2", "l1", "l1_ssim"]


@dataclass(frozen=True)
class LossOptions:
    """What is minimised.

    Attributes:
        kind: `l2`, mean squared error; `l1`; `l1_ssim`, (1 − λ)·L1 + λ·(1 − SSIM), which needs windows.
        ssim_weight: λ.
        compression: µ of the compression log(1 + µx)/log(1 + µ) of radiance in units of the peak; 0 for none.
    """

    kind: LossKind = "l2"
    ssim_weight: float = 0.2
    compression: float = 0.0


def compressed(values: Tensor, strength: float) -> Tensor:
    """µ-law: log(1 + µx)/log(1 + µ), odd, so that values below zero keep a gradient; x itself for µ = 0."""
    if strength == 0.0:
        return values
    return values.sign() * torch.log1p(strength * values.abs()) / math.log1p(strength)


def image_loss(rendered: Tensor, photographed: Tensor, peak: float, options: LossOptions, window: bool) -> Tensor:
    """Scalar loss of pixels (P, 3), or with `window` of an image (H, W, 3).

    Args:
        peak: radiance that counts as 1.

    Raises:
        ValueError: SSIM of pixels that stand alone.
    """
    x, y = (compressed(values / peak, options.compression) for values in (rendered, photographed))
    if options.kind == "l2":
        return (x - y).square().mean()
    absolute = (x - y).abs().mean()
    if options.kind == "l1":
        return absolute
    if not window:
        raise ValueError("the loss `l1_ssim` compares windows of images, got pixels that stand alone")
    return (1.0 - options.ssim_weight) * absolute + options.ssim_weight * (1.0 - ssim_map(x, y).mean())
