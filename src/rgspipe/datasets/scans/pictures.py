"""The pixels of a capture's files: photographs as linear light with what is clipped, and depth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.display_image import DAMAGED, opened, read_levels, saturated_from
from rgspipe.datasets.exr import read_channels, read_depth_channel
from rgspipe.datasets.images import LINEAR, NO_SURFACE, read_colour
from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.radiance_image import hdr_size
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.datasets.scans.frame import DepthImage
from rgspipe.datasets.scans.raw_image import RAW, read_raw
from rgspipe.datasets.tiff_image import tiff_size
from rgspipe.errors import InputError
from rgspipe.scene import srgb

#: Alpha from which on a pixel is opaque; floats of renderers may miss 1 by this.
OPAQUE = 1.0 - 1e-3

#: Level of 16-bit depth that tells no distance.
FARTHEST = 65535

#: Depth whose largest level is below this is rounded by more than 2 % everywhere: no surface comes of it.
FEWEST_STEPS = 25

Pixels = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Picture:
    """A photograph.

    Attributes:
        light: (H, W, 3) float32, linear.
        clipped_from: where it is as bright as this the photograph tells only that there was at least so much light;
            None where it was not clipped by its format.
        hidden: (H, W) bool, where it is not opaque, so that its colours say nothing of the room; None if it is.
    """

    light: Pixels
    clipped_from: float | None
    hidden: npt.NDArray[np.bool_] | None = None


def read_picture(path: Path, response: str, stated: tuple[int, int] | None = None) -> Picture:
    """A photograph in 8 or 16 bits, by its `response` ("srgb" or "linear"), or in floats.

    Args:
        stated: as of `read_levels`.

    Raises:
        InputError: missing or broken file, another format than the suffix says, pixels to be turned (EXIF), or levels
            by another curve than that of sRGB.
    """
    if path.suffix.lower() in LINEAR:
        light, alpha = read_colour(path)
        return Picture(light.numpy(), None, _not_opaque(alpha.numpy()))
    if path.suffix.lower() in RAW:
        return Picture(*read_raw(path))
    stored, limit = read_levels(path, stated), saturated_from(path)
    linear = response == "linear"
    light = stored.values if linear else stored.light
    light = np.repeat(light, 3, axis=2) if light.shape[2] == 1 else light
    # Of levels that are stored, not of light, where the file has no curve.
    limit = float(srgb.encode(np.array(limit))) if linear else limit
    return Picture(light, limit, None if stored.alpha is None else _not_opaque(stored.alpha))


def _not_opaque(alpha: Pixels) -> npt.NDArray[np.bool_] | None:
    """(H, W) where alpha is below 1; None where it nowhere is."""
    hidden = alpha < OPAQUE
    return hidden if hidden.any() else None


def read_depth_image(image: DepthImage) -> Pixels:
    """(H, W) float32 depth in the unit of the cameras' places; NaN where it is not known.

    Raises:
        InputError: missing or broken file, colours, 8 bits, or a confidence of another size.
    """
    stored = _stored_depth(image.path) if image.disparity is None else _predicted_depth(image.path, *image.disparity)
    known = np.isfinite(stored) & (stored > 0.0) & (stored < NO_SURFACE)
    if image.confidence is not None:
        sure = _confidence(image.confidence)
        if sure.shape != stored.shape:
            expected = f"{stored.shape[1]} × {stored.shape[0]} pixels, as {image.path.name}"
            found = f"{sure.shape[1]} × {sure.shape[0]}"
            raise InputError(image.confidence, expected=expected, found=found, remedy="Export both at one size.")
        known &= sure > 0.0
    return np.where(known, stored * image.unit, np.nan).astype(np.float32)


@timed
def _stored_depth(path: Path) -> npt.NDArray[np.float64]:
    suffix = path.suffix.lower()
    if suffix == ".bin":
        return _colmap_array(path)
    if suffix == ".dat":
        return _openrooms_array(path)
    if suffix == ".npy":
        return _numpy_array(path)
    if suffix == ".exr":
        return read_depth_channel(path).astype(np.float64)
    levels = read_levels(path).levels
    if levels.dtype != np.uint16 or levels.shape[2] != 1:
        raise InputError(
            path,
            expected="depth in 16 bits of grey, or EXR",
            found="8 bits, which is a picture of depth",
            remedy="Export the depth itself.",
        )
    # The highest level is all that is too far as well, or nothing measured.
    measured = levels[(levels > 0) & (levels < FARTHEST)]
    if len(measured) and measured.max() < FEWEST_STEPS:
        raise InputError(
            path,
            expected=f"depth in steps that are small beside it, so levels of {FEWEST_STEPS} and more",
            found=f"levels up to {measured.max()}, as of depth in metres that was rounded",
            remedy="Multiply depth by 1000, for millimetres, before it is made whole numbers.",
        )
    return np.where(levels == FARTHEST, np.nan, levels.astype(np.float64))[..., 0]


def _predicted_depth(path: Path, scale: float, offset: float) -> npt.NDArray[np.float64]:
    """(H, W) of levels that say how near a surface is, of which 8 bits hold the lower ones of 65536, too."""
    levels = read_levels(path).levels.astype(np.float64)
    if not (levels == levels[..., :1]).all():
        raise InputError(path, expected="levels of grey", found="colours", remedy="Export the levels themselves.")
    with np.errstate(divide="ignore"):
        return 1.0 / (levels[..., 0] / (FARTHEST + 1) * scale + offset)


def _confidence(path: Path) -> Pixels:
    return read_levels(path).values[..., 0]


def _colmap_array(path: Path) -> npt.NDArray[np.float64]:
    """(H, W) of "width&height&channels&" and float32, rows first."""
    content = input_file(path, "a depth map of COLMAP", most_bytes=reading_limits().image_bytes).read_bytes()
    parts = content[:64].split(b"&", 3)
    try:
        width, height, channels = (int(part) for part in parts[:3])
        start = sum(len(part) + 1 for part in parts[:3])
        check_pixel_count(path, width, height)
        if channels < 1:
            raise ValueError(f"{channels} channels")
        values = np.frombuffer(content, "<f4", width * height * channels, start)
    except (ValueError, IndexError) as error:
        found = f"other bytes ({error})"
        raise InputError(path, expected="a depth map of COLMAP", found=found, remedy="Write it anew.") from error
    with np.errstate(invalid="ignore"):
        return values[: width * height].reshape(height, width).astype(np.float64)


def _numpy_array(path: Path) -> npt.NDArray[np.float64]:
    """(H, W) of an array of numpy, which nerfstudio reads, too; its header alone allocates nothing."""
    input_file(path, "depth of numpy", most_bytes=reading_limits().image_bytes)
    try:
        stored = np.lib.format.open_memmap(path, mode="r")
        if stored.dtype.kind not in "fiu" or stored.size == 0 or stored.ndim not in (2, 3):
            raise ValueError(f"{stored.dtype} of shape {stored.shape}")
        values = stored.reshape(stored.shape[:2])  # one channel at most
        check_pixel_count(path, values.shape[1], values.shape[0])
    except InputError:
        raise
    except (OSError, ValueError, OverflowError, SyntaxError) as error:
        expected, remedy = "an array (H, W) of depth, as numpy.save writes it", "Write it anew."
        raise InputError(path, expected=expected, found=f"other content ({error})", remedy=remedy) from error
    return values.astype(np.float64)


def _openrooms_array(path: Path) -> npt.NDArray[np.float64]:
    """(H, W) of two int32, height and width, and float32, rows first."""
    content = input_file(path, "depth of OpenRooms", most_bytes=reading_limits().image_bytes).read_bytes()
    height, width = (int(size) for size in np.frombuffer(content[:8].ljust(8, b"\0"), "<i4"))
    check_pixel_count(path, width, height)
    if len(content) != 8 + 4 * width * height:
        found = f"{len(content)} bytes, where {height} × {width} pixels take {8 + 4 * width * height}"
        raise InputError(path, expected="depth of OpenRooms", found=found, remedy="Copy it anew.")
    with np.errstate(invalid="ignore"):
        return np.frombuffer(content, "<f4", offset=8).reshape(height, width).astype(np.float64)


def size_of(path: Path) -> tuple[int, int]:
    """Width and height of an image.

    Raises:
        InputError: missing or broken file.
    """
    if path.suffix.lower() == ".exr":
        height, width = next(iter(read_channels(path).values())).shape
        return width, height
    if path.suffix.lower() == ".hdr":
        return hdr_size(path)
    if path.suffix.lower() in LINEAR:
        return tiff_size(path)
    try:
        with opened(input_file(path, "an image"), path, ["PNG", "JPEG"]) as file:
            return file.size
    except InputError:
        raise
    except DAMAGED as error:
        found = f"an unreadable file ({error})"
        raise InputError(path, expected="a PNG or JPEG image", found=found, remedy="Export it again.") from error
