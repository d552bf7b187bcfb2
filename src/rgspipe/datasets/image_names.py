"""Names of images in files of cameras, which other programs write in several ways."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rgspipe.datasets.input_file import is_there
from rgspipe.errors import InputError

#: Suffixes of images; a name without one is that of the first of these that is there, or else of an .exr.
SUFFIXES = (".exr", ".png", ".jpg", ".jpeg", ".hdr", ".tif", ".tiff")


def image_named(folder: Path, name: str) -> Path:
    """The image by a name relative to a folder, which may be as on Windows: with backslashes, or .jpg for .JPG; or lack
    its suffix.
    """
    path = folder / name
    if not is_there(path) and "\\" in name:
        path = folder / name.replace("\\", "/")
    if is_there(path):
        return path
    if path.name.lower().endswith(SUFFIXES):
        others = (path.with_suffix(suffix) for suffix in (path.suffix.lower(), path.suffix.upper()))
        return next((other for other in others if is_there(other)), path)
    places = [path.with_name(path.name + suffix) for low in SUFFIXES for suffix in (low, low.upper())]
    return next((place for place in places if is_there(place)), places[0])


def check_once(images: Sequence[Path], where: Path) -> None:
    """Refuse an image that several frames have: it was taken from one place.

    Raises:
        InputError: names it and the frames of the file `where`.
    """
    places: dict[str, int] = {}
    for index, path in enumerate(images):
        if (first := places.setdefault(os.path.normpath(path), index)) < index:
            found = f"{path.name} in frames[{first}] and frames[{index}]"
            raise InputError(where, expected="each image once", found=found, remedy="Leave one of the frames out.")
