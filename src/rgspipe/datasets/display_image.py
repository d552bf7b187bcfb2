"""PNG and JPEG images, as the levels that they hold; nothing is decoded that is not one of the two."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import ExifTags, Image, UnidentifiedImageError

from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.jpeg_data import check_codes
from rgspipe.datasets.reading_limits import timed
from rgspipe.datasets.stored_curve import other_curve
from rgspipe.errors import InputError
from rgspipe.scene import srgb

Pixels = npt.NDArray[np.float32]

#: What a file may be, by its suffix. Pillow would start Ghostscript for an EPS image by another name.
FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}

#: What the pixels of each of Pillow's modes become: grey or colour, with alpha or without.
MODES = {"1": "L", "L": "L", "LA": "LA", "RGB": "RGB", "RGBA": "RGBA", "P": "RGB", "PA": "RGBA"}

#: Where a PNG has depth and type of colours; the types of colours, without and with alpha, and of grey with alpha.
DEPTH, COLOUR_TYPE, COLOURED, GREY_ALPHA = 24, 25, (2, 6), 4

#: Levels by which a JPEG's colours may miss, besides what its tables leave out: brightness and two differences of
#: colour are rounded, and these go into blue 1.77 times.
COLOUR_ROUNDING = 1.5

#: EXIF's orientations that exchange width and height, and the logarithm of their ratio from which that is to be seen.
ON_SIDE, NO_SQUARE = (5, 6, 7, 8), 0.05

#: What Pillow raises of damaged files, and of those that claim more pixels than it decodes.
DAMAGED = (OSError, SyntaxError, ValueError, MemoryError, Image.DecompressionBombError)


@contextlib.contextmanager
def opened(source: Path | io.BytesIO, path: Path, formats: Sequence[str]) -> Iterator[Image.Image]:
    """An image of one of these formats, by its header: pixels are decoded when they are asked for.

    Raises:
        InputError: more pixels than are read; names `path`.
        OSError, SyntaxError, ValueError: another format, or a broken file; see DAMAGED.
    """
    with warnings.catch_warnings():
        # Pillow warns of sizes, where the limit is our own, and of damaged tags, which nobody relies on.
        warnings.simplefilter("ignore")
        with Image.open(source, formats=formats) as file:
            check_pixel_count(path, *file.size)
            yield file


@dataclass(frozen=True, eq=False)
class Levels:
    """What a PNG or JPEG stores, palettes resolved.

    Attributes:
        levels: (H, W, 1 or 3) uint8 or uint16.
        opaque: (H, W) of the same type, if it has alpha.
        other_curve: what is said where light is asked for and the file states another curve than that of sRGB.
    """

    levels: np.ndarray
    opaque: np.ndarray | None
    other_curve: InputError | None = None

    @property
    def values(self) -> Pixels:
        """(H, W, 1 or 3) in [0, 1]."""
        return _shares(self.levels)

    @property
    def alpha(self) -> Pixels | None:
        """(H, W) in [0, 1]."""
        return None if self.opaque is None else _shares(self.opaque)

    @property
    def light(self) -> Pixels:
        """(H, W, 1 or 3) in [0, 1], linearised with the sRGB curve.

        Raises:
            InputError: the file states another one.
        """
        if self.other_curve is not None:
            raise self.other_curve
        return srgb.decode_levels(self.levels)


def _shares(levels: np.ndarray) -> Pixels:
    return np.ascontiguousarray(levels / np.float32(np.iinfo(levels.dtype).max), np.float32)


@timed
def read_levels(path: Path, stated: tuple[int, int] | None = None) -> Levels:
    """What an image stores.

    Args:
        stated: width and height of an image of the shape that the camera's intrinsics are of, where these are stated:
            they tell whether a photograph on its side is meant as it is stored.

    Raises:
        InputError: missing or broken file, too many pixels, another format than the suffix says, CMYK, or 16-bit
            grey with alpha, which no library at hand reads whole.
    """
    input_file(path, "an image")
    stored, curve = _levels(path, _format(path), stated)
    stored = stored[..., None] if stored.ndim == 2 else stored
    channels = stored.shape[2]
    has_alpha = channels in (2, 4)
    return Levels(stored[..., : channels - has_alpha], stored[..., -1] if has_alpha else None, curve)


def read_colour_levels(path: Path) -> Levels:
    """What an image in colour stores.

    Raises:
        InputError: as `read_levels`; also for images in grey.
    """
    stored = read_levels(path)
    if stored.levels.shape[2] != 3:
        raise _refusal(path, "8-bit RGB or RGBA", "grey levels")
    return stored


def saturated_from(path: Path) -> float:
    """Linear radiance from which on an image that can be read may have been clipped at its brightest level.

    In a PNG that is the brightest level itself, in a JPEG also what may have become of it: the levels within twice
    the standard deviation of what its table of brightness leaves out. Coefficients of an orthonormal transform are
    rounded to multiples of q, so that the error of a pixel has the variance of q² / 12 in the mean.
    """
    margin, kind = 0.5, _format(path)
    most = float(2 ** _depth(path, kind)[0] - 1)
    if kind == "JPEG":
        with opened(path, path, ["JPEG"]) as file:
            table = np.asarray(file.quantization[0], dtype=np.float64)
        margin += COLOUR_ROUNDING + 2.0 * float(np.sqrt(np.mean(table**2) / 12.0))
    return float(srgb.decode(np.array(max(most - margin, 0.0) / most)))


def _format(path: Path) -> str:
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        raise _refusal(path, f"an image ending in .exr, {', '.join(FORMATS)}", path.suffix or "no suffix")
    return kind


def _levels(path: Path, kind: str, stated: tuple[int, int] | None) -> tuple[np.ndarray, InputError | None]:
    """(H, W) or (H, W, C) uint8 or uint16; and what speaks against taking them for sRGB."""
    try:
        with opened(path, path, [kind]) as file:
            depth, colour_type = _depth(path, kind)
            if depth == 16 and colour_type == GREY_ALPHA:
                raise _refusal(path, "8 bits a channel, or 16 of grey or colours", "16 of grey and alpha")
            _check_orientation(path, file, stated)
            wide = depth == 16 and colour_type in COLOURED
            stored, curve = (_wide if wide else _unpacked)(path, file), other_curve(path, file)
        if kind == "JPEG":
            check_codes(path, path.read_bytes(), stored, lambda content: _decoded(path, content))
        return stored, curve
    except InputError:
        raise
    except UnidentifiedImageError as error:
        raise _refusal(
            path, f"a {kind} image, as its name says", "an unreadable file: another format, or damaged"
        ) from error
    except DAMAGED as error:
        raise _refusal(path, "a whole PNG or OpenEXR image", f"an unreadable file ({error})") from error


def _decoded(path: Path, content: bytes) -> np.ndarray | None:
    """What the content of a JPEG stores; None if it cannot be read."""
    try:
        with opened(io.BytesIO(content), path, ["JPEG"]) as file:
            return _unpacked(path, file)
    except (InputError, *DAMAGED):
        return None


def _depth(path: Path, kind: str) -> tuple[int, int]:
    """Bits a channel of at least 8, and a PNG's type of colours."""
    if kind != "PNG":
        return 8, 2
    with path.open("rb") as stream:
        header = stream.read(COLOUR_TYPE + 1)
    return max(header[DEPTH], 8), header[COLOUR_TYPE]


def _wide(path: Path, file: Image.Image) -> np.ndarray:
    """(H, W, 3 or 4) uint16 of 16-bit colours, of which Pillow reads the upper byte.

    The lower one is what it reads as the upper byte where it is told the other order of bytes.
    """
    levels = np.asarray(file).astype(np.uint16)
    levels <<= 8
    with opened(path, path, ["PNG"]) as again:
        again.tile = [part._replace(args=f"{again.mode};16L") for part in again.tile]
        levels |= np.asarray(again)
    return _with_clear(levels, file)


def _with_clear(levels: np.ndarray, file: Image.Image) -> np.ndarray:
    """(H, W, C or C + 1) uint16: with alpha if the file says that one level or colour is transparent."""
    clear = file.info.get("transparency")
    if clear is None:
        return levels
    opaque = np.where((levels == np.array(clear)).all(axis=2), 0, np.iinfo(np.uint16).max)
    return np.dstack([levels, opaque.astype(np.uint16)])


def _check_orientation(path: Path, file: Image.Image, stated: tuple[int, int] | None) -> None:
    """Refuse pixels that are to be turned before they are shown, unless intrinsics of the stored shape are stated.

    A camera's pose may be meant for either.
    """
    turned = file.getexif().get(ExifTags.Base.Orientation, 1)
    if turned not in (0, 1) and not (turned in ON_SIDE and stated is not None and _lies_as(file.size, stated)):
        raise InputError(
            path,
            expected="pixels as they are shown: no EXIF orientation, or 1",
            found=f"orientation {turned}",
            remedy="If poses and intrinsics are of the pixels as they are stored (COLMAP takes them so), remove the "
            "tag (exiftool -Orientation= FILE); if they are of the image as it is shown, turn the pixels (mogrify "
            "-auto-orient FILE).",
        )


def _lies_as(size: tuple[int, int], stated: tuple[int, int]) -> bool:
    """Whether an image, which is no square, is longer in the direction in which one of the stated size is.

    Whether their shapes agree is asked of all photographs.
    """
    ratios = [np.log(width / height) for width, height in (size, stated)]
    return bool(min(abs(ratio) for ratio in ratios) > NO_SQUARE and ratios[0] * ratios[1] > 0.0)


def _unpacked(path: Path, file: Image.Image) -> np.ndarray:
    if file.mode.startswith("I;16"):
        return _with_clear(np.asarray(file).astype(np.uint16)[..., None], file)
    mode = MODES.get(file.mode)
    if mode is None:
        raise _refusal(path, "grey, RGB or RGBA", f"{file.mode} pixels")
    if "transparency" in file.info:  # of a palette, or one colour that is
        mode = "LA" if mode == "L" else "RGBA"
    return np.asarray(file if mode == file.mode else file.convert(mode))


def _refusal(path: Path, expected: str, found: str) -> InputError:
    return InputError(path, expected=expected, found=found, remedy="Export it as 8-bit PNG, or as OpenEXR.")
