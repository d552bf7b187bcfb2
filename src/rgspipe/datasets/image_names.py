"""Names of images in files of cameras, which other programs write in several ways."""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.input_file import is_there

#: Suffixes of images; a name without one is that of the first of these that is there, or else of an .exr.
SUFFIXES = (".exr", ".png", ".jpg", ".jpeg", ".hdr", ".tif", ".tiff")


def image_named(folder: Path, name: str) -> Path:
    """The image by a name relative to a folder, which may lack its suffix, or have backslashes as on Windows."""
    path = folder / name
    if not is_there(path) and "\\" in name:
        path = folder / name.replace("\\", "/")
    if is_there(path) or path.name.lower().endswith(SUFFIXES):
        return path
    places = [path.with_name(path.name + suffix) for low in SUFFIXES for suffix in (low, low.upper())]
    return next((place for place in places if is_there(place)), places[0])
