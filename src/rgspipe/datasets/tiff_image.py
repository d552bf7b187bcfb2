"""TIFF images of floats without compression, which are linear; of whole numbers no TIFF says by which curve."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import tifffile

from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.errors import InputError

Pixels = npt.NDArray[np.float32]

WHAT = "a TIFF image of floats: grey, or red, green, blue and alpha"

#: Values of tags: no compression, grey and colours, the upper left corner first, planes one after the other, alpha
#: that colours were multiplied by, and that they were not.
PLAIN, KINDS, UPRIGHT, PLANES, PREMULTIPLIED, STRAIGHT = 1, (1, 2), 1, 2, 1, 2

#: Where a remedy is the same for all.
CONVERT = "Write it as OpenEXR, or as TIFF of floats without compression."


def tiff_size(path: Path) -> tuple[int, int]:
    """Width and height.

    Raises:
        InputError: missing or broken file, or another kind of TIFF.
    """
    image, _ = read_tiff(path)
    return image.shape[1], image.shape[0]


@timed
def read_tiff(path: Path) -> tuple[Pixels, Pixels]:
    """(H, W, 3) linear light, premultiplied by alpha, and alpha (H, W), which is 1 where the file has none.

    Raises:
        InputError: missing or broken file, too many pixels, several images, NaN or infinity, or another kind of TIFF.
    """
    file = input_file(path, "a TIFF image", most_bytes=2 * reading_limits().image_bytes)
    try:
        with _complaints() as complaints, tifffile.TiffFile(file) as opened:
            if len(opened.pages) != 1:
                raise _refusal(path, f"{len(opened.pages)} images in one file", "Write the one that is meant alone.")
            page = opened.pages[0]
            _check_kind(path, page)
            stored = page.asarray()
            if complaints:
                raise ValueError(complaints[0])
    except InputError:
        raise
    except Exception as error:  # the library says of no broken file what it raises
        raise _refusal(path, f"a file that cannot be read ({str(error)[:200]})") from error
    stored = np.moveaxis(stored, 0, -1) if page.samplesperpixel > 1 and page.planarconfig == PLANES else stored
    values = stored.reshape(page.imagelength, page.imagewidth, -1).astype(np.float32)
    if not np.isfinite(values).all():
        raise _refusal(path, "NaN or infinity in its pixels")
    colours, alpha = values[..., :3], values[..., 3] if values.shape[2] == 4 else np.ones(values.shape[:2], np.float32)
    if page.extrasamples == (STRAIGHT,):
        colours = colours * alpha[..., None]
    return np.array(np.broadcast_to(colours, (*alpha.shape, 3))), np.array(alpha)


@contextlib.contextmanager
def _complaints() -> Iterator[list[str]]:
    """What the library says of damaged tags, which it passes over, in the place of printing it."""
    found, logger, here = [], tifffile.logger(), threading.get_ident()
    handler, spoken = logging.Handler(logging.ERROR), logger.propagate
    handler.emit = lambda record: found.append(record.getMessage()) if record.thread == here else None
    logger.addHandler(handler)
    logger.propagate = False
    try:
        yield found
    finally:
        logger.propagate = spoken
        logger.removeHandler(handler)


def _check_kind(path: Path, page: tifffile.TiffPage) -> None:
    """Refuse what would be read wrongly, by the tags alone."""
    check_pixel_count(path, page.imagewidth, page.imagelength)
    if page.dtype is None or page.dtype.kind != "f":
        remedy = "Of which curve they are no TIFF says: write those of sRGB as PNG, and linear ones as OpenEXR."
        raise _refusal(path, f"whole numbers of {page.bitspersample} bits", remedy)
    extra = tuple(page.extrasamples)
    alpha = page.samplesperpixel == 4 and extra in ((PREMULTIPLIED,), (STRAIGHT,))
    if page.photometric not in KINDS or not (alpha or (page.samplesperpixel in (1, 3) and not extra)):
        raise _refusal(path, f"{page.samplesperpixel} channels of which nothing says what they are")
    if page.compression != PLAIN:
        raise _refusal(path, f"compression {page.compression}")
    need = page.imagewidth * page.imagelength * page.samplesperpixel * page.dtype.itemsize
    if need > (have := path.stat().st_size):
        raise _refusal(path, f"half of one: {have} bytes, where its pixels take {need}", "Copy it anew.")
    turned = page.tags.get("Orientation")
    if turned is not None and turned.value != UPRIGHT:
        raise _refusal(path, f"pixels to be turned (orientation {turned.value})")


def _refusal(path: Path, found: str, remedy: str = CONVERT) -> InputError:
    return InputError(path, expected=WHAT, found=found, remedy=remedy)
