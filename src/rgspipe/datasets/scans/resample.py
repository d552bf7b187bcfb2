"""Photographs and depth brought to the pixels of a camera without distortion, of the size that is worked with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import torch

from rgspipe.datasets.scans.frame import Lens, Numbers
from rgspipe.errors import InputError
from rgspipe.scene import Camera

#: Samples that are looked up at once.
MOST_SAMPLES = 1_000_000

#: Most that focal lengths grow so that every pixel shows what the photograph shows, and steps in which that is found.
MOST_CROPPED, STEPS = 4.0, 30

#: Depths of neighbours that differ by more than this part of them lie on different surfaces.
SAME_SURFACE = 0.05

#: Corners that weigh less than this do not count.
LEAST_WEIGHT = 1e-6


def straight_camera(lens: Lens, pose: Numbers, longest: int, where: Path) -> Camera:
    """A camera without distortion and with at most `longest` pixels along a side, all of which the photograph shows.

    Raises:
        InputError: no part of the image is free of the lens's folds.
    """
    factor = _crop(lens, where) if lens.bends else 1.0
    fx, fy = lens.fx * factor, lens.fy * factor
    camera = Camera(torch.from_numpy(pose), fx, fy, lens.cx, lens.cy, lens.width, lens.height)
    return camera.reduced(longest)


def resampled_colour(
    image: npt.NDArray[np.float32], clipped_from: float | None, camera: Camera, lens: Lens
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """(H, W, 3) means of an image over the pixels of a camera, and where any of what they are means of was clipped."""
    lens = lens.resized(image.shape[1], image.shape[0])
    clipped = np.zeros(image.shape, bool) if clipped_from is None else image >= clipped_from
    colour = np.empty((camera.height, camera.width, 3), np.float32)
    marked = np.empty(colour.shape, bool)
    for rows, columns_at, rows_at in _samples(camera, lens):
        mean, any_clipped = np.zeros((*columns_at.shape, 3)), np.zeros((*columns_at.shape, 3), bool)
        for row, column, weight in _corners(columns_at, rows_at, image.shape[:2]):
            mean += weight[..., None] * image[row, column]
            any_clipped |= clipped[row, column] & (weight > LEAST_WEIGHT)[..., None]
        colour[rows], marked[rows] = mean.mean(axis=2), any_clipped.any(axis=2)
    return colour, marked


def resampled_depth(depth: npt.NDArray[np.float32], camera: Camera, lens: Lens) -> npt.NDArray[np.float32]:
    """(H, W) medians of planar depth over the pixels of a camera; NaN where less than half is known or in the image.

    1/z is linear in the image of a plane, so that is what is interpolated, within a surface.
    """
    lens = lens.resized(depth.shape[1], depth.shape[0])
    found = np.empty((camera.height, camera.width), np.float32)
    for rows, columns_at, rows_at in _samples(camera, lens):
        found[rows] = _middle(_depth_at(depth, columns_at, rows_at))
    return found


def _samples(camera: Camera, lens: Lens) -> Iterator[tuple[slice, Numbers, Numbers]]:
    """By rows of the camera, where (R, W, S) places in its pixels are in the lens's image, as dense as that is."""
    counts = [max(1, int(np.ceil(ratio - 1e-9))) for ratio in (lens.height / camera.height, lens.width / camera.width)]
    # As dense both ways as the denser one, but that an image of one row is not looked at in as many rows as columns.
    most = MOST_SAMPLES // (camera.width * max(counts))
    steps = [min(max(counts), max(count, most)) for count in counts]
    down, across = (part.reshape(-1) for part in np.meshgrid(*map(_within, steps), indexing="ij"))
    x = (np.arange(camera.width)[:, None] + across - camera.cx) / camera.fx
    height = max(1, MOST_SAMPLES // (camera.width * len(across)))
    for first in range(0, camera.height, height):
        rows = slice(first, min(first + height, camera.height))
        y = (np.arange(rows.start, rows.stop)[:, None, None] + down - camera.cy) / camera.fy
        yield rows, *lens.places(*np.broadcast_arrays(x[None], y))


def _within(count: int) -> Numbers:
    """(s,) so many places evenly within a pixel."""
    return (np.arange(count) + 0.5) / count


def _corners(
    columns: Numbers, rows: Numbers, shape: tuple[int, ...]
) -> list[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Numbers]]:
    """Row, column and weight of the four pixels around places; beyond the border its pixels go on."""
    left, top = np.floor(columns - 0.5), np.floor(rows - 0.5)
    across, down = columns - 0.5 - left, rows - 0.5 - top
    found = []
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        row = np.clip(top + i, 0, shape[0] - 1).astype(np.int64)
        column = np.clip(left + j, 0, shape[1] - 1).astype(np.int64)
        found.append((row, column, (down if i else 1.0 - down) * (across if j else 1.0 - across)))
    return found


def _depth_at(depth: npt.NDArray[np.float32], columns: Numbers, rows: Numbers) -> Numbers:
    """Depth at places (…,): between the four around it where they are of one surface, else the nearest pixel's.

    NaN outside of the image: another camera than the photograph's may have looked at less.
    """
    corners = _corners(columns, rows, depth.shape)
    values = np.stack([depth[row, column].astype(np.float64) for row, column, _ in corners])
    weights = np.stack([weight for _, _, weight in corners])
    counts = weights > LEAST_WEIGHT
    nearest = np.take_along_axis(values, weights.argmax(axis=0)[None], axis=0)[0]
    values = np.where(counts, values, nearest)
    smooth = values.max(axis=0) <= (1.0 + SAME_SURFACE) * values.min(axis=0)
    inside = (columns >= 0.0) & (columns <= depth.shape[1]) & (rows >= 0.0) & (rows <= depth.shape[0])
    with np.errstate(invalid="ignore"):
        found = np.where(smooth, weights.sum(axis=0) / (weights / values).sum(axis=0), nearest)
    return np.where(inside, found, np.nan)


def _middle(samples: Numbers) -> Numbers:
    """Medians (…,) of (…, S) depths, NaN where less than half is known; between surfaces the nearer one's."""
    ordered = np.sort(samples, axis=-1)
    known = np.isfinite(ordered).sum(axis=-1)
    lower, upper = (
        np.take_along_axis(ordered, np.maximum(place, 0)[..., None], axis=-1)[..., 0]
        for place in ((known - 1) // 2, known // 2)
    )
    upper = np.where(upper <= (1.0 + SAME_SURFACE) * lower, upper, lower)
    return np.where(2 * known >= samples.shape[-1], 0.5 * (lower + upper), np.nan)


def _crop(lens: Lens, where: Path) -> float:
    """The least factor on focal lengths with which every pixel lies within the image that the lens bends."""
    if _fits(lens, 1.0):
        return 1.0
    low, high = 1.0, MOST_CROPPED
    if not _fits(lens, high):
        raise InputError(
            where,
            expected="distortion (k1, k2, …, p1, p2) under which the image shows what a camera without it would",
            found=f"radial {[*lens.radial, *lens.rational]}, tangential {list(lens.tangential)}",
            remedy="Check the coefficients: they are those of OpenCV's model, of images in units of the focal length.",
        )
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _fits(lens, middle) else (middle, high)
    return high


def _fits(lens: Lens, factor: float) -> bool:
    """Whether the border of the image without distortion lies in the image, before the lens folds it back."""
    across, down = np.linspace(0.0, lens.width, 65), np.linspace(0.0, lens.height, 65)
    columns = np.concatenate([across, across, np.zeros(65), np.full(65, float(lens.width))])
    rows = np.concatenate([np.zeros(65), np.full(65, float(lens.height)), down, down])
    x, y = (columns - lens.cx) / (lens.fx * factor), (rows - lens.cy) / (lens.fy * factor)
    u, v = lens.places(x, y)
    inside = (u >= 0.0) & (u <= lens.width) & (v >= 0.0) & (v <= lens.height)
    # With only radial terms a ray farther out must be seen farther out.
    radial, reach = replace(lens, tangential=(0.0, 0.0)), np.linspace(0.0, np.hypot(x, y).max(), 65)
    outwards = np.diff(radial.places(reach, np.zeros(65))[0]) > 0.0
    return bool(inside.all() and outwards.all())
