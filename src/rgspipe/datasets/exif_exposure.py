"""What photographs state of their exposure (EXIF), so that other exposures are not taken for the same one."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import ExifTags

from rgspipe.datasets.display_image import DAMAGED, FORMATS, opened
from rgspipe.datasets.input_file import input_file
from rgspipe.errors import InputError

#: What a camera can have been set to: shutter [s], ISO and f-number; what is beyond it is damaged.
EXPOSED = ((1e-7, 1e5), (1.0, 1e8), (0.1, 1e3))

#: Stated exposures that differ by less than this part are the same: 1/125 s is 1/128.
ALIKE = 0.05

#: What to do where no exposure can be free.
EXPOSE_ALIKE = (
    "Photograph all with one exposure; where the images were made alike since, remove what they state of it (exiftool "
    "-ExposureTime= FILE)."
)


def exposure_of(path: Path) -> float | None:
    """Shutter time × ISO / aperture², by the file's EXIF; None where it does not state all three."""
    if path.suffix.lower() not in FORMATS:
        return None
    keys = (ExifTags.Base.ExposureTime, ExifTags.Base.ISOSpeedRatings, ExifTags.Base.FNumber)
    try:
        with opened(input_file(path, "a photograph"), path, ["JPEG", "PNG"]) as file:
            tags = file.getexif().get_ifd(ExifTags.IFD.Exif)
        shutter, sensitivity, aperture = (float(np.ravel(tags.get(key, 0))[0]) for key in keys)
    except InputError:
        raise
    except (*DAMAGED, TypeError, ZeroDivisionError):
        # Whether its pixels can be read is asked elsewhere.
        return None
    values = zip((shutter, sensitivity, aperture), EXPOSED, strict=True)
    stated = all(least <= value <= most for value, (least, most) in values)
    return shutter * sensitivity / aperture**2 if stated else None


def differ(exposures: Iterable[float]) -> bool:
    """Whether any two exposures are not the same."""
    known = list(exposures)
    return bool(known) and max(known) > (1.0 + ALIKE) * min(known)


def check_exposures(stated: Iterable[tuple[str, float | None]], where: str | Path, remedy: str) -> None:
    """Refuse images that are taken for exposed alike where their files state otherwise.

    Args:
        stated: name and exposure of each image, None where it states none.

    Raises:
        InputError: two of them differ by more than ALIKE; names both, and the factor.
    """
    known = [(exposure, name) for name, exposure in stated if exposure is not None]
    if not differ(exposure for exposure, _ in known):
        return
    (least, less), (most, more) = min(known), max(known)
    found = f"{more} exposed {most / least:.3g} times as much as {less}, as they state (EXIF)"
    raise InputError(where, expected="images that were exposed alike", found=found, remedy=remedy)
