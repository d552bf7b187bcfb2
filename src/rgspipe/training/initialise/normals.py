"""Surface normals of one view from its planar depth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import correlate1d, minimum_filter, uniform_filter

#: Windows that a noisy depth map may need, in pixels from the centre to the border.
RADII = (1, 2, 3, 5, 7)

#: Share of a window's pixels that must be known.
LEAST_KNOWN = 0.5

#: A larger window is taken while noise would turn the normals by more than this [rad].
NOISE_TOLERANCE = 0.08

#: A window whose relative rms deviation from a plane is larger, by more than noise, shows no surface.
LARGEST_DEVIATION = 0.05


@dataclass(frozen=True)
class PlaneFits:
    """What the planes that were fitted to a depth map say of its pixels.

    Attributes:
        normals: (H, W, 3) float64 unit normals in camera axes that face the camera, 0 where there is none.
        valid: (H, W) the pixels that have one.
        depth: (H, W) float64 planar depth of the fitted planes, scene units; meaningless where not valid.
        deviation: median relative rms deviation of the depth from the fits.
    """

    normals: np.ndarray
    valid: np.ndarray
    depth: np.ndarray
    deviation: float


def normals_from_depth(
    depth: np.ndarray, focal: tuple[float, float], center: tuple[float, float], radius: int | None = None
) -> PlaneFits:
    """Normals in camera axes (x right, y up, looking along −z), by fitting planes to the inverse depth.

    On a plane 1/z is an affine function of the pixel, 1/z = a·X + b·Y + c with (X, Y, −1) the pixel's ray,
    and the normal is along ±(a, b, −c). Every window of the image gets such a fit; each pixel takes the
    best-fitting one of the windows that contain or touch it. A pixel beside an edge thus finds a window on its own
    side, where an average around the pixel would round the edge.

    Args:
        depth: (H, W) planar depth at pixel centres, scene units; +inf where there is no surface, NaN where it is
            not known.
        focal: fx, fy in pixels.
        center: cx, cy in pixels.
        radius: half width of the windows in pixels; by default the smallest of RADII at which the map's
            own noise, seen as deviation from the fits, turns the normals by at most NOISE_TOLERANCE.
    """
    if radius is not None:
        return _fit(depth, focal, center, radius)
    for radius in RADII:
        fits = _fit(depth, focal, center, radius)
        turn = fits.deviation * math.sqrt(focal[0] * focal[1]) / math.sqrt(_spread(radius) * (2 * radius + 1) ** 2)
        if turn <= NOISE_TOLERANCE or 2 * RADII[-1] + 1 > min(depth.shape):
            break
    return fits


def _fit(depth: np.ndarray, focal: tuple[float, float], center: tuple[float, float], radius: int) -> PlaneFits:
    height, width = depth.shape
    known = np.isfinite(depth)
    inverse = np.where(known, 1.0 / np.where(known, depth, 1.0), 0.0).astype(np.float64)
    fit_windows = _window_fits if not np.isnan(depth).any() else _window_fits_with_gaps
    mean, slope_x, slope_y, deviation = fit_windows(inverse, known, np.isposinf(depth), radius)

    best = np.full(depth.shape, np.inf)
    chosen = np.zeros((3, height, width))
    # One step beyond the window: the tip of a corner is in no whole window of its own face, but on its plane.
    # Five positions an axis are all of them for radius 1 and enough for larger windows, which overlap.
    reach = [round(step * (radius + 1) / 2) for step in range(-2, 3)]
    for dy in reach:
        for dx in reach:
            into, source = _shifted(height, dy), _shifted(height, -dy)
            into_x, source_x = _shifted(width, dx), _shifted(width, -dx)
            window, pixel = (source, source_x), (into, into_x)
            fitted = mean[window] + dx * slope_x[window] + dy * slope_y[window]
            off = (fitted - inverse[pixel]) / np.maximum(inverse[pixel], 1e-30)
            # The pixel's own residual counts too: a good window just beyond an edge must not win. Windows that
            # fit about equally well, as on smooth curves, lose by their distance; the tiny constant, far below
            # float32, has the same effect where all fit exactly.
            away = 1.0 + (dx * dx + dy * dy) / radius**2
            cost = away * (deviation[window] ** 2 + 0.15 * off**2 + 1e-14)
            better = cost < best[pixel]
            best[pixel] = np.where(better, cost, best[pixel])
            for index, values in enumerate((fitted, slope_x[window], slope_y[window])):
                chosen[index][pixel] = np.where(better, values, chosen[index][pixel])

    fitting = deviation[known & np.isfinite(deviation)]
    noise = float(np.median(fitting)) if len(fitting) else 0.0
    at_pixel, per_column, per_row = chosen
    valid = known & (best < LARGEST_DEVIATION**2 + 2.0 * noise**2) & ~_straddles(best, noise, radius) & (at_pixel > 0)
    column, row = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
    a, b = per_column * focal[0], -per_row * focal[1]
    x, y = (column - center[0]) / focal[0], -(row - center[1]) / focal[1]
    # n·(X, Y, −1) < 0 faces the camera; with n = (−a, −b, c) that product is −1/z.
    normals = np.stack([-a, -b, at_pixel - a * x - b * y], axis=-1)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    fitted_depth = 1.0 / np.where(at_pixel > 0, at_pixel, np.inf)
    normals = np.where(valid[..., None], normals, 0.0)
    return PlaneFits(normals, valid, fitted_depth, noise)


def _straddles(cost: np.ndarray, noise: float, radius: int) -> np.ndarray:
    """Where even the best window fits ten times worse than that of a pixel nearby: it lies across an edge.

    Compared with its surroundings, not with the whole map, so that curved surfaces beside flat ones stay.
    """
    nearby = minimum_filter(cost, 2 * radius + 3)
    return cost > 100.0 * nearby + 9.0 * noise**2 + 1e-10


Fits = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _window_fits(inverse: np.ndarray, known: np.ndarray, empty: np.ndarray, radius: int) -> Fits:
    """Least-squares planes in the window around each pixel: mean, slopes per column and row, relative rms deviation.

    The deviation is infinite for windows that leave the image or hold pixels without a surface.
    """
    size = 2 * radius + 1
    offsets = np.arange(-radius, radius + 1, dtype=np.float64)
    mean = uniform_filter(inverse, size, mode="constant")
    square = uniform_filter(inverse * inverse, size, mode="constant")
    spread = _spread(radius)
    along = [
        correlate1d(correlate1d(inverse, offsets, axis, mode="constant"), np.ones(size), 1 - axis, mode="constant")
        for axis in (1, 0)
    ]
    slope_x, slope_y = (moment / (spread * size * size) for moment in along)
    variance = square - mean * mean - spread * (slope_x * slope_x + slope_y * slope_y)
    whole = uniform_filter(known.astype(np.float64), size, mode="constant") > 1.0 - 1e-6
    deviation = np.sqrt(np.maximum(variance, 0.0)) / np.maximum(mean, 1e-300)
    return mean, slope_x, slope_y, np.where(whole, deviation, np.inf)


def _window_fits_with_gaps(inverse: np.ndarray, known: np.ndarray, empty: np.ndarray, radius: int) -> Fits:
    """The same for windows with unknown pixels; at least LEAST_KNOWN of a window must be known, and none empty.

    What is called the mean here is the plane's value in the middle.
    """
    size = 2 * radius + 1
    ones, steps = np.ones(size), np.arange(-radius, radius + 1, dtype=np.float64)

    def moment(values: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        return correlate1d(correlate1d(values, rows, 0, mode="constant"), columns, 1, mode="constant")

    weight, value = known.astype(np.float64), np.where(known, inverse, 0.0)
    count, x, y = moment(weight, ones, ones), moment(weight, ones, steps), moment(weight, steps, ones)
    xx, yy = moment(weight, ones, steps**2), moment(weight, steps**2, ones)
    xy = moment(weight, steps, steps)
    right = np.stack([moment(value, *k) for k in ((ones, ones), (ones, steps), (steps, ones))], axis=-1)
    matrix = np.stack([count, x, y, x, xx, xy, y, xy, yy], axis=-1).reshape(*inverse.shape, 3, 3)
    usable = (count >= LEAST_KNOWN * size * size) & (moment(empty.astype(np.float64), ones, ones) == 0)
    # Half a window beyond the image would pass for gaps.
    usable &= moment(np.ones(inverse.shape), ones, ones) == size * size
    matrix[~usable] = np.eye(3)
    plane = np.linalg.solve(matrix + 1e-9 * np.eye(3), right[..., None])[..., 0]
    left_over = moment(value * value, ones, ones) - (plane * right).sum(axis=-1)
    deviation = np.sqrt(np.maximum(left_over, 0.0) / np.maximum(count, 1.0)) / np.maximum(plane[..., 0], 1e-300)
    return plane[..., 0], plane[..., 1], plane[..., 2], np.where(usable, deviation, np.inf)


def _spread(radius: int) -> float:
    """Variance of a window's pixel offsets along one axis."""
    return radius * (radius + 1) / 3.0


def _shifted(length: int, by: int) -> slice:
    """The part of an axis that remains in it when moved back by `by`."""
    return slice(max(by, 0), length + min(by, 0))
