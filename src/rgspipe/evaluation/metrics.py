"""The measures that every table uses, each defined once."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from rgspipe.evaluation.arrays import ArrayLike, to_array, to_mask

#: The target's percentile that counts as white in a PSNR.
PEAK_PERCENTILE = 99.5
#: A light counts as found when its position error is at most this fraction of the scene's longest side.
SUCCESS_LIMIT = 0.01
#: Resamples behind the interval of a median.
RESAMPLES = 2000


def peak(target: ArrayLike) -> float:
    """The value that counts as white: the 99.5th percentile over all pixels and channels of `target`."""
    return float(np.percentile(to_array(target), PEAK_PERCENTILE))


def psnr(image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> float:
    """Peak signal-to-noise ratio of linear radiance, 10·log₁₀(peak² / mean squared error) [dB].

    The peak is that of the whole target, with or without a mask, so masked and unmasked figures of
    one image can be compared.

    Args:
        image: (H, W, C) linear radiance.
        target: (H, W, C) linear radiance.
        mask: (H, W) boolean, True where a pixel counts; all pixels if None.

    Returns:
        dB; inf for identical images; NaN where the measure has no meaning: a target whose peak is not
        above zero (all black), a mask that leaves no pixel, or an image with NaN in the counted pixels.

    Raises:
        ValueError: shapes differ, or the target is not finite.
    """
    image, target = to_array(image), to_array(target)
    if image.shape != target.shape or image.ndim != 3:
        raise ValueError(f"psnr needs two images of shape (H, W, C), got {image.shape} and {target.shape}")
    if not np.isfinite(target).all():
        raise ValueError("psnr needs a finite target, got NaN or infinite pixels")
    white = peak(target)
    if mask is not None:
        counted = to_mask(mask)
        if counted.shape != target.shape[:2]:
            raise ValueError(f"the mask must have shape {target.shape[:2]}, got {counted.shape}")
        image, target = image[counted], target[counted]
    if white <= 0.0 or target.size == 0:
        return math.nan
    # Scaled first, so that very bright or very dim images neither overflow nor vanish when squared.
    error = float(np.mean(((image - target) / white) ** 2))
    return math.inf if error == 0.0 else -10.0 * math.log10(error)


def longest_side(bounds: ArrayLike) -> float:
    """The longest side of a bounding box (2, 3), lower corner first, in its own units.

    Raises:
        ValueError: the box is not (2, 3), not finite, or has no extent.
    """
    box = to_array(bounds)
    if box.shape != (2, 3) or not np.isfinite(box).all():
        raise ValueError(f"bounds must be two finite corners of shape (2, 3), got {box.tolist()}")
    side = float((box[1] - box[0]).max())
    if side <= 0.0:
        raise ValueError(f"the bounding box {box.tolist()} has no extent; the lower corner comes first")
    return side


def position_error(estimate: ArrayLike, truth: ArrayLike, scene_size: float) -> float:
    """Distance between two positions (3,) as a fraction of `scene_size`, the scene's longest side.

    An estimate that is not finite has an error of inf, so that a failed fit counts against a median.
    """
    estimate, truth = to_array(estimate), to_array(truth)
    if estimate.shape != (3,) or truth.shape != (3,):
        raise ValueError(f"positions must have shape (3,), got {estimate.shape} and {truth.shape}")
    if not (math.isfinite(scene_size) and scene_size > 0.0):
        raise ValueError(f"the scene size must be positive and finite, got {scene_size}")
    if not np.isfinite(truth).all():
        raise ValueError(f"the true position must be finite, got {truth.tolist()}")
    if not np.isfinite(estimate).all():
        return math.inf
    return float(np.linalg.norm(estimate - truth)) / scene_size


def intensity_error(estimate: ArrayLike, truth: ArrayLike) -> float:
    """Mean over RGB of |a / a* − 1| for intensities (3,); a fraction, not percent.

    Channels in which the true light is dark have no relative error and are left out; NaN when all of
    them are. An estimate that is not finite has an error of inf.
    """
    estimate, truth = to_array(estimate), to_array(truth)
    if estimate.shape != (3,) or truth.shape != (3,):
        raise ValueError(f"intensities must have shape (3,), got {estimate.shape} and {truth.shape}")
    if not np.isfinite(truth).all() or (truth < 0.0).any():
        raise ValueError(f"the true intensity must be finite and not negative, got {truth.tolist()}")
    lit = truth > 0.0
    if not lit.any():
        return math.nan
    if not np.isfinite(estimate).all():
        return math.inf
    return float(np.abs(estimate[lit] / truth[lit] - 1.0).mean())


def angle_between(estimate: ArrayLike, truth: ArrayLike) -> float:
    """Angle between two directions (3,) of any length, degrees; inf for an estimate that is not finite or zero."""
    estimate, truth = to_array(estimate), to_array(truth)
    if not np.isfinite(estimate).all() or not estimate.any():
        return math.inf
    across = float(np.linalg.norm(np.cross(estimate, truth)))
    return math.degrees(math.atan2(across, float(estimate @ truth)))


def success(error: float, limit: float = SUCCESS_LIMIT) -> bool:
    """Whether a position error (a fraction of the scene size) is within `limit`; NaN and inf are not."""
    return bool(error <= limit)


def bootstrap_median(
    values: ArrayLike, generator: np.random.Generator, resamples: int = RESAMPLES, confidence: float = 0.95
) -> tuple[float, float]:
    """Percentile bootstrap interval of the median.

    Bounds are themselves medians of resamples (no interpolation), so infinite errors of failed fits
    are allowed and NaN cannot arise from them.

    Args:
        values: (n,) numbers without NaN.
        generator: the source of the resampling; the same state gives the same interval.
        resamples: how many resamples are drawn.
        confidence: coverage, in (0, 1).

    Returns:
        (low, high); both NaN without values, both the value itself with one.
    """
    sample = to_array(values).reshape(-1)
    if np.isnan(sample).any():
        raise ValueError("the values of a bootstrap must not contain NaN; leave out what was not measured")
    if not 0.0 < confidence < 1.0 or resamples < 1:
        raise ValueError(f"needs 0 < confidence < 1 and resamples ≥ 1, got {confidence} and {resamples}")
    if sample.size == 0:
        return math.nan, math.nan
    draws = generator.integers(0, sample.size, size=(resamples, sample.size))
    medians = np.median(sample[draws], axis=1)
    tail = 50.0 * (1.0 - confidence)
    low = np.percentile(medians, tail, method="inverted_cdf")
    high = np.percentile(medians, 100.0 - tail, method="inverted_cdf")
    return float(low), float(high)


def edge_mask(
    depth: ArrayLike,
    normal: ArrayLike,
    *,
    depth_jump: float = 0.01,
    normal_angle: float = math.radians(15.0),
    dilation: int = 1,
) -> npt.NDArray[np.bool_]:
    """Pixels at silhouettes and creases, where a pixel's colour mixes surfaces.

    On a plane the inverse of planar depth is affine in the image however steeply the plane is seen,
    so its second difference marks depth jumps without marking floors at a grazing angle.

    Args:
        depth: (H, W) planar z, +inf (or 0) where there is no surface.
        normal: (H, W, 3) unit normals, 0 where there is no surface.
        depth_jump: second difference of inverse depth, relative to the larger inverse depth of the
            neighbourhood, above which a pixel is an edge.
        normal_angle: angle between neighbouring normals [rad] above which both pixels are edges.
        dilation: by how many pixels the mask grows, in each of the eight directions.

    Returns:
        (H, W) boolean, True = edge.
    """
    depth, normal = to_array(depth), to_array(normal)
    if depth.ndim != 2 or normal.shape != (*depth.shape, 3):
        raise ValueError(f"edge_mask needs depth (H, W) and normal (H, W, 3), got {depth.shape} and {normal.shape}")
    if np.isnan(depth).any() or np.isnan(normal).any() or (depth < 0.0).any():
        raise ValueError("edge_mask needs depth ≥ 0 (or +inf) and no NaN")
    inverse = np.where(depth > 0.0, 1.0 / np.where(depth > 0.0, depth, 1.0), 0.0)
    edge = _bends(inverse, depth_jump) | _bends(inverse.T, depth_jump).T
    edge |= _turns(normal, normal_angle) | _turns(normal.swapaxes(0, 1), normal_angle).T
    if dilation > 0:
        edge = ndimage.binary_dilation(edge, np.ones((3, 3), dtype=bool), iterations=dilation)
    return edge


def _bends(inverse: npt.NDArray[np.float64], limit: float) -> npt.NDArray[np.bool_]:
    """Where the second difference along rows exceeds `limit` of the largest of the three values."""
    bend = np.zeros(inverse.shape, dtype=bool)
    before, here, after = inverse[:, :-2], inverse[:, 1:-1], inverse[:, 2:]
    largest = np.maximum(np.maximum(before, here), after)
    bend[:, 1:-1] = np.abs(before - 2.0 * here + after) > limit * largest
    return bend


def _turns(normal: npt.NDArray[np.float64], limit: float) -> npt.NDArray[np.bool_]:
    """Both pixels of every horizontal pair whose normals differ by more than `limit` [rad]."""
    left, right = normal[:, :-1], normal[:, 1:]
    present = (np.abs(left).sum(-1) > 0.0) & (np.abs(right).sum(-1) > 0.0)
    one_missing = (np.abs(left).sum(-1) > 0.0) ^ (np.abs(right).sum(-1) > 0.0)
    turned = (present & ((left * right).sum(-1) < math.cos(limit))) | one_missing
    edge = np.zeros(normal.shape[:2], dtype=bool)
    edge[:, :-1] |= turned
    edge[:, 1:] |= turned
    return edge
