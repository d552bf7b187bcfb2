"""SSIM and HDR-FLIP: what equal, shifted, scaled and broken images must give."""

import math

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter

from rgspipe.evaluation import image_metrics, metrics
from rgspipe.optim import ssim as loss

MEASURES = (image_metrics.ssim, image_metrics.hdr_flip)


def _picture(size: int = 48) -> np.ndarray:
    """Smooth radiance with one bright edge, up to about 3."""
    noise = gaussian_filter(np.random.default_rng(0).uniform(size=(size, size, 3)), (3, 3, 0))
    picture = 1.0 + 4.0 * (noise - 0.5)
    picture[:, size // 2 :] *= 2.0
    return picture


def test_equal_images_are_perfect() -> None:
    target = _picture()
    assert image_metrics.ssim(target, target) == pytest.approx(1.0, abs=1e-12)
    assert image_metrics.hdr_flip(target, target) == 0.0


@pytest.mark.parametrize("scale", [1e-6, 1e3, 1e6])
@pytest.mark.parametrize("measure", MEASURES)
def test_the_unit_of_radiance_does_not_matter(measure, scale: float) -> None:
    target = _picture()
    image = target * 1.05
    assert measure(image * scale, target * scale) == pytest.approx(measure(image, target), abs=1e-6)  # up to 1e-8


def test_more_blur_is_worse_by_both_measures() -> None:
    target = _picture()
    blurred = [gaussian_filter(target, (sigma, sigma, 0)) for sigma in (0.7, 1.5, 3.0)]
    similar = [image_metrics.ssim(image, target) for image in blurred]
    visible = [image_metrics.hdr_flip(image, target) for image in blurred]
    assert 1.0 > similar[0] > similar[1] > similar[2]
    assert 0.0 < visible[0] < visible[1] < visible[2]


def test_ssim_is_that_of_the_loss_away_from_the_border() -> None:
    target = _picture(64)
    target /= metrics.peak(target)
    image = gaussian_filter(target, (1, 1, 0))
    # An independent implementation, but for the border: there the images are equal.
    inside = np.zeros((64, 64, 1), dtype=bool)
    inside[16:-16, 16:-16] = True
    image = np.where(inside, image, target)
    tensors = (torch.from_numpy(part.clip(0.0, 1.0)) for part in (image, target))
    # Both sum up the same differences; one averages over all pixels, the other over those 5 from the border or more.
    lost = 64**2 * (1.0 - float(loss.ssim(*tensors)))
    assert 54**2 * (1.0 - image_metrics.ssim(image, target)) == pytest.approx(lost, rel=1e-6)


def test_flip_counts_dark_regions_that_psnr_does_not_see() -> None:
    target = _picture()
    target[:, :24] *= 0.02
    image = target.copy()
    image[:, :24] *= 1.5
    assert metrics.psnr(image, target) > 35.0
    assert image_metrics.hdr_flip(image, target) > 0.02


def test_flip_of_white_against_black_is_near_its_maximum() -> None:
    target = np.ones((32, 32, 3))
    assert image_metrics.hdr_flip(0.0 * target, target) > 0.8
    assert image_metrics.hdr_flip(-target, target) == image_metrics.hdr_flip(0.0 * target, target)


@pytest.mark.parametrize("measure", MEASURES)
def test_what_cannot_be_compared_is_nan_or_refused(measure) -> None:
    target = _picture()
    broken = target.copy()
    broken[0, 0, 0] = np.nan
    assert math.isnan(measure(broken, target))
    # The library behind FLIP would end the process at a black target.
    assert math.isnan(measure(target, 0.0 * target))
    with pytest.raises(ValueError, match="finite target"):
        measure(target, broken)
    with pytest.raises(ValueError, match="shape"):
        measure(target[:-1], target)


def test_ssim_of_images_smaller_than_its_window_is_not_known() -> None:
    assert math.isnan(image_metrics.ssim(np.ones((8, 8, 3)), np.ones((8, 8, 3))))
