"""Radiance's pictures (.hdr): red, green, blue and a shared exponent, packed by runs (Ward 1991, Graphics Gems II)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.reading_limits import HEADER_BYTES, reading_limits, timed
from rgspipe.errors import InputError

WHAT = "a Radiance picture (.hdr)"

#: Rows from the top and columns from the left, which is what all write.
SIZE = re.compile(rb"\n\n-Y (\d{1,6}) \+X (\d{1,6})\n")

#: The line of the header that names the format of pixels, and the one that is read: not CIE's XYZ.
FORMAT, PIXELS = re.compile(rb"\nFORMAT *= *([^\n]*?)[ \r]*(?=\n)"), b"32-bit_rle_rgbe"

#: Lines of the header that say what pixels are, besides their format; each may stand there several times.
VARIABLES = re.compile(rb"\n(EXPOSURE|PIXASPECT|COLORCORR) *=([^\n]*)")

#: The least that pixels may have been multiplied by; the most is as many times 1.
LEAST_EXPOSED = 1e-9

#: Red, green and blue of what says how often the pixel before it is repeated: one of a pixel is 128 at least, or all 0.
REPEATED = 1

#: Widths of packed rows, and the two bytes that these begin with.
PACKED, MARK = range(8, 32768), b"\x02\x02"


def hdr_size(path: Path) -> tuple[int, int]:
    """Width and height.

    Raises:
        InputError: missing or broken file.
    """
    return _header(path, _content(path))[:2]


@timed
def read_hdr(path: Path) -> npt.NDArray[np.float32]:
    """(H, W, 3) linear light.

    Raises:
        InputError: missing or broken file, or too many pixels.
    """
    content = _content(path)
    width, height, place = _header(path, content)
    exposed = _exposed(path, content[:place])
    rows = np.empty((height, width, 4), np.uint8)
    try:
        for row in range(height):
            rows[row], place = _row(content, place, width)
        if place != len(content):
            raise ValueError(f"{len(content) - place} bytes after its last row")
    except (IndexError, ValueError) as error:
        found = f"half of one, or another packing ({error})"
        raise InputError(path, expected=WHAT, found=found, remedy="Copy it anew, or convert it to EXR.") from error
    scale = np.where(rows[..., 3] > 0, np.ldexp(1.0, rows[..., 3].astype(np.int64) - 136), 0.0) / exposed
    return ((rows[..., :3] + 0.5) * scale[..., None]).astype(np.float32)


def _content(path: Path) -> bytes:
    return input_file(path, WHAT, most_bytes=reading_limits().image_bytes).read_bytes()


def _header(path: Path, content: bytes) -> tuple[int, int, int]:
    """Width, height, and where pixels begin."""
    head = content[:HEADER_BYTES]
    size = SIZE.search(head)
    formats = set() if size is None else set(FORMAT.findall(head[: size.start() + 1]))
    if not head.startswith(b"#?") or size is None or formats != {PIXELS}:
        stated = b", ".join(sorted(formats)).decode(errors="replace")
        other = "another format, or rows in another order than from the top"
        found = other if formats in (set(), {PIXELS}) else f"FORMAT={stated:.80}"
        raise InputError(path, expected=WHAT, found=found, remedy="Convert it to EXR.")
    height, width = int(size[1]), int(size[2])
    check_pixel_count(path, width, height)
    return width, height, size.end()


def _exposed(path: Path, header: bytes) -> float:
    """What all pixels were multiplied by, which their light has to be divided by.

    Raises:
        InputError: no number that can be, or pixels that are no squares or have other colours than red, green, blue.
    """
    exposed = 1.0
    for key, value in VARIABLES.findall(header):
        try:
            number = [float(part) for part in value.split()]
        except ValueError:
            number = []
        if key == b"EXPOSURE" and len(number) == 1 and LEAST_EXPOSED <= number[0] <= 1.0 / LEAST_EXPOSED:
            exposed *= number[0]
        elif key == b"EXPOSURE" or not number or any(one != 1.0 for one in number):
            found = f"{key.decode()}={value.decode(errors='replace').strip()}"
            expected = "square pixels without a correction of colours, and exposures that can be"
            raise InputError(path, expected=expected, found=found, remedy="Convert it to EXR.")
    return exposed


def _row(content: bytes, place: int, width: int) -> tuple[npt.NDArray[np.uint8], int]:
    """(W, 4) bytes of a row that begins at `place`, and where the next one does."""
    if width not in PACKED or content[place : place + 2] != MARK or content[place + 2] > 127:
        values = np.frombuffer(content, np.uint8, 4 * width, place).reshape(width, 4)
        if (values[:, :3] == REPEATED).all(axis=1).any():
            raise ValueError("runs of pixels, as before 1991")
        return values, place + 4 * width
    if int.from_bytes(content[place + 2 : place + 4], "big") != width:
        raise ValueError("a row of another width")
    place, channels = place + 4, []
    for _ in range(4):
        values, place = _runs(content, place, width)
        channels.append(values)
    return np.frombuffer(b"".join(channels), np.uint8).reshape(4, width).T, place


def _runs(content: bytes, place: int, width: int) -> tuple[bytes, int]:
    """`width` bytes of one channel, and where it ends."""
    parts, count = [], 0
    while count < width:
        code = content[place]
        length = code - 128 if code > 128 else code
        part = content[place + 1 : place + 2] * length if code > 128 else content[place + 1 : place + 1 + length]
        if not 0 < length == len(part) or count + length > width:
            raise ValueError("a run that does not fit its row")
        parts.append(part)
        count, place = count + length, place + (2 if code > 128 else 1 + length)
    return b"".join(parts), place
