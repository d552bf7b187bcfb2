"""By which curve a PNG or JPEG says that its levels are stored, where that is another one than that of sRGB.

Which red, green and blue they are of does not matter: light bounces alike in all, and lamps are told in them.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
from PIL import ExifTags, Image, ImageCms

from rgspipe.errors import InputError

#: What a PNG of sRGB states as its gamma, and by how much it may miss that.
DISPLAY_GAMMA, SAME_GAMMA = 1.0 / 2.2, 0.03

#: Levels by which a profile may show greys otherwise than sRGB: its variants do by 2, a gamma of 2.2 by 7.
SAME_LEVELS = 3

#: Transfer characteristics of a PNG's chunk cICP (ITU-T H.273): of sRGB, and of none that is stated.
SRGB_TRANSFER, NO_TRANSFER = 13, 2

#: What EXIF says of colours: the tag and the value of sRGB, and how DCF names AdobeRGB.
COLOUR_SPACE, SRGB_SPACE, ADOBE = 0xA001, 1, "R03"


def other_curve(path: Path, file: Image.Image) -> InputError | None:
    """What to say of colours that a file states to be stored by another curve than that of a display.

    What a PNG says in cICP stands above all else that it says, sRGB above a profile's curve, a profile above a gamma.
    """
    stated = _transfer(path) if file.format == "PNG" else None
    if stated is None or stated[0] == NO_TRANSFER:
        found, what = _older(file)
    else:
        transfer, full = stated
        alike = transfer == SRGB_TRANSFER and full == 1
        other = f"transfer characteristics {transfer} of {'all' if full == 1 else 'only some'} levels"
        found, what = None if alike else other, "the chunk cICP"
    remedy = f"Convert the image to sRGB, or, if its levels are meant as they are, remove {what}."
    return None if found is None else InputError(path, expected="colours as of sRGB", found=found, remedy=remedy)


def _older(file: Image.Image) -> tuple[str | None, str]:
    """Which other curve is stated by what is older than cICP, and by what."""
    gamma, profile = file.info.get("gamma", DISPLAY_GAMMA), file.info.get("icc_profile")
    if "srgb" in file.info:
        return None, ""
    if profile:
        return _profile_curve(profile, file.mode), "its colour profile"
    if _is_adobe(file):
        return "AdobeRGB, whose curve is a gamma of 2.2", "its EXIF"
    return None if abs(gamma - DISPLAY_GAMMA) <= SAME_GAMMA else f"a gamma of {gamma:g}", "the chunk gAMA"


def _profile_curve(profile: bytes, mode: str) -> str | None:
    """What an ICC profile makes of greys that sRGB does not; None if nothing, or it is not to be understood."""
    ramp = np.arange(256, dtype=np.uint8)[None]
    grey = Image.fromarray(ramp).convert("L" if mode in ("L", "LA", "1") or mode.startswith("I;16") else "RGB")
    try:
        own = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
        shown = ImageCms.profileToProfile(grey, own, ImageCms.createProfile("sRGB"), intent, outputMode="RGB")
        name = ImageCms.getProfileDescription(own).strip()
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):  # damaged, or of other colours: shown as without it
        return None
    off = int(np.abs(np.asarray(shown, dtype=np.int64) - ramp[..., None]).max())
    return f"the profile {name!r:.80}, which shows greys {off} levels off" if off > SAME_LEVELS else None


def _is_adobe(file: Image.Image) -> bool:
    """Whether EXIF says so, as cameras do that are set to it and write no profile."""
    try:
        exif = file.getexif()
        space = exif.get_ifd(ExifTags.IFD.Exif).get(COLOUR_SPACE)
        named = str(exif.get_ifd(ExifTags.IFD.Interop).get(ExifTags.Interop.InteropIndex, ""))
    except (OSError, SyntaxError, ValueError, TypeError, KeyError, struct.error):  # damaged: it says nothing
        return False
    return named.startswith(ADOBE) and space != SRGB_SPACE


def _transfer(path: Path) -> tuple[int, int] | None:
    """Transfer characteristics, and whether all levels are used, by a PNG's chunk cICP, of which Pillow knows nothing.

    It stands before the pixels.
    """
    with path.open("rb") as stream:
        stream.seek(8)
        while len(start := stream.read(8)) == 8:
            length, name = struct.unpack(">I4s", start)
            if name == b"IDAT":
                return None
            if name == b"cICP":
                content = stream.read(min(length, 4))
                return (content[1], content[3]) if len(content) == 4 else None
            stream.seek(length + 4, io.SEEK_CUR)
    return None
