"""How like its target an image looks: structural similarity and HDR-FLIP, beside the PSNR of `metrics`."""

from __future__ import annotations

import math

import flip_evaluator
import numpy as np
import numpy.typing as npt
from skimage.metrics import structural_similarity

from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.metrics import peak

#: Standard deviation [pixels] of the Gaussian window of SSIM, and how wide scikit-image makes that window.
SSIM_SIGMA, SSIM_WINDOW = 1.5, 11

#: Pixels per degree of visual angle for FLIP: its authors' default, a 0.7 m wide 4K screen seen from 0.7 m.
PIXELS_PER_DEGREE = 67.02064


def ssim(image: ArrayLike, target: ArrayLike) -> float:
    """Structural similarity of linear radiance, exposed as for the PSNR: over the target's peak, clipped to [0, 1].

    Gaussian window and constants as published (Wang, Bovik, Sheikh and Simoncelli 2004), mean over pixels and channels.

    Args:
        image, target: (H, W, 3) linear radiance.

    Returns:
        up to 1, which equal images have; NaN for a target whose peak is not above zero, an image with NaN, or images
        smaller than the window of 11 pixels.

    Raises:
        ValueError: shapes differ, or the target is not finite.
    """
    pair = _exposed(image, target)
    if pair is None or min(pair[0].shape[:2]) < SSIM_WINDOW:
        return math.nan
    image, target = (np.clip(part, 0.0, 1.0) for part in pair)
    return float(
        structural_similarity(
            image,
            target,
            channel_axis=2,
            data_range=1.0,
            gaussian_weights=True,
            sigma=SSIM_SIGMA,
            use_sample_covariance=False,
        )
    )


def hdr_flip(image: ArrayLike, target: ArrayLike) -> float:
    """Mean HDR-FLIP error (Andersson, Nilsson, Shirley and Akenine-Möller 2021): how visible the difference is.

    The largest LDR-FLIP error over the exposures that the target calls for, at 67 pixels per degree. Exposures follow
    the target, so the unit of radiance does not matter. Negative radiance counts as black.

    Args:
        image, target: (H, W, 3) linear radiance.

    Returns:
        0 for equal images up to 1; NaN for a target whose peak is not above zero, or an image with NaN.

    Raises:
        ValueError: shapes differ, or the target is not finite.
    """
    pair = _exposed(image, target)
    if pair is None:
        return math.nan
    image, target = (np.ascontiguousarray(part.clip(min=0.0), dtype=np.float32) for part in pair)
    options = {"ppd": PIXELS_PER_DEGREE}
    return float(flip_evaluator.evaluate(target, image, "HDR", applyMagma=False, parameters=options)[1])


def _exposed(image: ArrayLike, target: ArrayLike) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None:
    """Both images over the target's peak; None where no comparison has a meaning."""
    image, target = to_array(image), to_array(target)
    if image.shape != target.shape or image.ndim != 3 or image.shape[2] != 3:
        raise ValueError(f"two images of shape (H, W, 3) are needed, got {image.shape} and {target.shape}")
    if not np.isfinite(target).all():
        raise ValueError("a comparison needs a finite target, got NaN or infinite pixels")
    white = peak(target)
    return None if white <= 0.0 or not np.isfinite(image).all() else (image / white, target / white)
