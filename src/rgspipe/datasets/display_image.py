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
from PIL import ExifTags, Image, ImageCms, UnidentifiedImageError

from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.reading_limits import timed
from rgspipe.errors import InputError
from rgspipe.scene import srgb

Pixels = npt.NDArray[np.float32]

#: What a file may be, by its suffix. Pillow would start Ghostscript for an EPS image by another name.
FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}

#: What the pixels of each of Pillow's modes become: grey or colour, with alpha or without.
MODES = {"1": "L", "L": "L", "LA": "LA", "RGB": "RGB", "RGBA": "RGBA", "P": "RGB", "PA": "RGBA"}

#: Depth and colour type in a PNG's header; the type of pixels with three or four channels.
DEPTH, COLOUR_TYPE, COLOURED = 24, 25, (2, 4, 6)

#: Levels by which a JPEG's colours may miss, besides what its tables leave out: brightness and two differences of
#: colour are rounded, and these go into blue 1.77 times.
COLOUR_ROUNDING = 1.5

#: What a PNG of sRGB states as its gamma, and by how much it may miss that.
DISPLAY_GAMMA, SAME_GAMMA = 1.0 / 2.2, 0.03

#: Levels by which a profile may show greys otherwise than sRGB: its variants do by 2, a gamma of 2.2 by 7.
SAME_LEVELS = 3

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
def read_levels(path: Path) -> Levels:
    """What an image stores.

    Raises:
        InputError: missing or broken file, too many pixels, another format than the suffix says, CMYK, or 16-bit
            colour, which no library at hand reads whole.
    """
    input_file(path, "an image")
    stored, other_curve = _levels(path, _format(path))
    stored = stored[..., None] if stored.ndim == 2 else stored
    channels = stored.shape[2]
    has_alpha = channels in (2, 4)
    return Levels(stored[..., : channels - has_alpha], stored[..., -1] if has_alpha else None, other_curve)


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
    """Linear radiance from which on an 8-bit image that can be read may have been clipped at its brightest level.

    In a PNG that is the brightest level itself, in a JPEG also what may have become of it: the levels within twice
    the standard deviation of what its table of brightness leaves out. Coefficients of an orthonormal transform are
    rounded to multiples of q, so that the error of a pixel has the variance of q² / 12 in the mean.
    """
    margin = 0.5
    if _format(path) == "JPEG":
        with opened(path, path, ["JPEG"]) as file:
            table = np.asarray(file.quantization[0], dtype=np.float64)
        margin += COLOUR_ROUNDING + 2.0 * float(np.sqrt(np.mean(table**2) / 12.0))
    return float(srgb.decode(np.array(max(255.0 - margin, 0.0) / 255.0)))


def _format(path: Path) -> str:
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        raise _refusal(path, f"an image ending in .exr, {', '.join(FORMATS)}", path.suffix or "no suffix")
    return kind


def _levels(path: Path, kind: str) -> tuple[np.ndarray, InputError | None]:
    """(H, W) or (H, W, C) uint8, or uint16 of a grey image; and what speaks against taking them for sRGB."""
    try:
        with opened(path, path, [kind]) as file:
            _check_depth(path, kind)
            _check_orientation(path, file)
            return _unpacked(path, file), _other_curve(path, file)
    except InputError:
        raise
    except UnidentifiedImageError as error:
        raise _refusal(
            path, f"a {kind} image, as its name says", "an unreadable file: another format, or damaged"
        ) from error
    except DAMAGED as error:
        raise _refusal(path, "a whole PNG or OpenEXR image", f"an unreadable file ({error})") from error


def _check_depth(path: Path, kind: str) -> None:
    """Refuse 16-bit colours, of which Pillow drops the lower byte without a word."""
    with path.open("rb") as stream:
        header = stream.read(COLOUR_TYPE + 1)
    if kind == "PNG" and header[DEPTH] == 16 and header[COLOUR_TYPE] in COLOURED:
        raise _refusal(path, "8 bits a channel", "16, of which half would be lost")


def _check_orientation(path: Path, file: Image.Image) -> None:
    """Refuse pixels that are to be turned before they are shown: a camera's pose may be meant for either."""
    turned = file.getexif().get(ExifTags.Base.Orientation, 1)
    if turned not in (0, 1):
        raise InputError(
            path,
            expected="pixels as they are shown: no EXIF orientation, or 1",
            found=f"orientation {turned}",
            remedy="If poses and intrinsics are of the pixels as they are stored (COLMAP takes them so), remove the "
            "tag (exiftool -Orientation= FILE); if they are of the image as it is shown, turn the pixels (mogrify "
            "-auto-orient FILE).",
        )


def _other_curve(path: Path, file: Image.Image) -> InputError | None:
    """What to say of colours that a file states to be stored by another curve than that of a display.

    Which red, green and blue they are of does not matter: light bounces alike in all, and lamps are told in them.
    """
    gamma = file.info.get("gamma", DISPLAY_GAMMA)
    profile = file.info.get("icc_profile")
    if "srgb" in file.info:
        return None
    if profile:
        found, what = _profile_curve(profile, file.mode), "its colour profile"
    else:
        found, what = None if abs(gamma - DISPLAY_GAMMA) <= SAME_GAMMA else f"a gamma of {gamma:g}", "the chunk gAMA"
    remedy = f"Convert the image to sRGB, or, if its levels are meant as they are, remove {what}."
    return None if found is None else InputError(path, expected="colours as of sRGB", found=found, remedy=remedy)


def _profile_curve(profile: bytes, mode: str) -> str | None:
    """What an ICC profile makes of greys that sRGB does not; None if nothing, or it is not to be understood."""
    ramp = np.arange(256, dtype=np.uint8)[None]
    grey = Image.fromarray(ramp).convert("L" if mode in ("L", "LA", "1") else "RGB")
    try:
        own = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
        shown = ImageCms.profileToProfile(grey, own, ImageCms.createProfile("sRGB"), intent, outputMode="RGB")
        name = ImageCms.getProfileDescription(own).strip()
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):  # damaged, or of other colours: shown as without it
        return None
    off = int(np.abs(np.asarray(shown, dtype=np.int64) - ramp[..., None]).max())
    return f"the profile {name!r:.80}, which shows greys {off} levels off" if off > SAME_LEVELS else None


def _unpacked(path: Path, file: Image.Image) -> np.ndarray:
    if file.mode.startswith("I;16"):
        return np.asarray(file).astype(np.uint16)
    mode = MODES.get(file.mode)
    if mode is None:
        raise _refusal(path, "grey, RGB or RGBA", f"{file.mode} pixels")
    if "transparency" in file.info:  # of a palette, or one colour that is
        mode = "LA" if mode == "L" else "RGBA"
    return np.asarray(file if mode == file.mode else file.convert(mode))


def _refusal(path: Path, expected: str, found: str) -> InputError:
    return InputError(path, expected=expected, found=found, remedy="Export it as 8-bit PNG, or as OpenEXR.")
