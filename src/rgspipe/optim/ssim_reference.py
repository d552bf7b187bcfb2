"""Structural similarity to an image that stays, with its derivative by hand: what a descent asks for at every step.

`ssim.ssim_map` is the definition. Here the blurs of the fixed image are made once, and the derivative is three blurs
and some products, instead of a walk back through all that led to the value: at 128² half of the time of both together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from rgspipe.optim.ssim import C1, C2, LEAST_CONSTANT, blur


@dataclass(frozen=True)
class SsimReference:
    """An image that others are compared with.

    Attributes:
        image: (C, H, W) over `unit`, as are the next two.
        mean, square: (C, H, W) Gaussian-weighted means of it and of its square.
        unit: the brightest value where that is above 1, else 1.
    """

    image: Tensor
    mean: Tensor
    square: Tensor
    unit: Tensor

    @classmethod
    def of(cls, image: Tensor) -> SsimReference:
        """Of an image (H, W, C)."""
        unit = image.abs().amax().clamp(min=1.0)
        scaled = image.permute(2, 0, 1).contiguous() / unit
        return cls(scaled, blur(scaled), blur(scaled * scaled), unit)

    def similarity(self, image: Tensor) -> Tensor:
        """`ssim` of an image (H, W, C) and this one; gradients flow to the image."""
        if image.shape != (*self.image.shape[1:], self.image.shape[0]):
            raise ValueError(f"expected an image like one of {tuple(self.image.shape)}, got {tuple(image.shape)}")
        return _Similarity.apply(image, self)


class _Similarity(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, image: Tensor, reference: SsimReference) -> Tensor:
        similarity, slope = _similarity_and_slope(image.detach(), reference, ctx.needs_input_grad[0])
        ctx.slope = slope
        return similarity

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        return ctx.slope * gradient, None


def _similarity_and_slope(image: Tensor, reference: SsimReference, wanted: bool) -> tuple[Tensor, Tensor | None]:
    """Mean similarity, and its derivative (H, W, C) if wanted; names as in `ssim_map`."""
    unit = torch.maximum(image.abs().amax(), reference.unit)
    c1, c2 = ((c / unit / unit).clamp(min=LEAST_CONSTANT) for c in (C1, C2))
    share = reference.unit / unit
    x, y = image.permute(2, 0, 1).contiguous() / unit, reference.image * share
    mean_y, square_y = reference.mean * share, reference.square * share.square()
    mean_x, square_x, product = blur(torch.stack([x, x * x, x * y]))
    variance = square_x - mean_x * mean_x
    spread = variance.clamp(min=0.0) + (square_y - mean_y * mean_y).clamp(min=0.0)
    covariance, bound = product - mean_x * mean_y, 0.5 * spread
    within = covariance.abs() < bound
    bounded = torch.minimum(torch.maximum(covariance, -bound), bound)
    luminance_of, structure_of = mean_x * mean_x + mean_y * mean_y + c1, spread + c2
    luminance = (2.0 * mean_x * mean_y + c1) / luminance_of
    structure = (2.0 * bounded + c2) / structure_of
    similarity = (luminance * structure).mean()
    if not wanted:
        return similarity, None
    # Towards the spread, which the covariance follows where it is as large as can be; then towards the three blurs.
    by_structure = luminance / structure_of
    by_spread = by_structure * (torch.where(within, 0.0, torch.sign(bounded)) - structure)
    by_square = by_spread * (variance > 0.0)
    by_product = 2.0 * by_structure * within
    by_mean = 2.0 * (structure / luminance_of) * (mean_y - luminance * mean_x)
    by_mean = by_mean - by_product * mean_y - 2.0 * by_square * mean_x
    from_mean, from_square, from_product = blur(torch.stack([by_mean, by_square, by_product]))
    slope = (from_mean + 2.0 * x * from_square + y * from_product) / (unit * x.numel())
    return similarity, slope.permute(1, 2, 0)
