"""Photographs as sensors wrote them, by LibRaw: the extra `raw` (pip install 'rgspipe[raw]')."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.errors import InputError

#: Suffixes of the common makers' files.
RAW = (".dng", ".cr2", ".cr3", ".nef", ".arw", ".orf", ".rw2", ".raf", ".pef")

#: Part of the largest value from which on a pixel counts as clipped: interpolation between the sensor's colours blurs
#: what is.
CLIPPED = 0.98


@timed
def read_raw(path: Path) -> tuple[npt.NDArray[np.float32], float]:
    """(H, W, 3) linear light in the camera's white balance, and from where on it is clipped.

    Raises:
        InputError: missing or broken file, too many pixels, or LibRaw is not installed.
    """
    input_file(path, "a raw photograph", most_bytes=reading_limits().image_bytes)
    try:
        import rawpy
    except ImportError:
        found = "no rawpy, which reads it"
        remedy = "Install it (pip install 'rgspipe[raw]'), or develop the photographs without a curve, as EXR."
        raise InputError(path, expected="a raw photograph", found=found, remedy=remedy) from None
    try:
        with rawpy.imread(str(path)) as raw:
            check_pixel_count(path, raw.sizes.width, raw.sizes.height)
            levels = raw.postprocess(
                gamma=(1, 1), no_auto_bright=True, use_camera_wb=True, output_bps=16, user_flip=0,
                output_color=rawpy.ColorSpace.sRGB, highlight_mode=rawpy.HighlightMode.Clip,
            )  # fmt: skip
    except (rawpy.LibRawError, OSError, ValueError) as error:
        found = f"an unreadable file ({str(error)[:200]})"
        raise InputError(path, expected="a raw photograph", found=found, remedy="Copy it anew.") from error
    return (levels / 65535.0).astype(np.float32), CLIPPED
