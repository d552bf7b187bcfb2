"""One photograph with what a network predicts of it, as Intrinsic Image Diffusion writes it: image, albedo, depth.

Either folders `im/ albedo/ depth/` with files of one name, or the files im, albedo and depth in one folder. There is
no camera: it is level, at the origin, looks along +y, and its field of view is a setting. Predicted depth has no unit:
its median is made 1.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.scans.frame import DepthImage, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import read_depth_image, size_of
from rgspipe.datasets.scans.single import chosen, lens_by_field, level_pose
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opengl"

WANTED = "im.png (or im/NAME.png) with albedo and depth beside it"

#: Degrees that the method takes for granted.
USUAL_FIELD = 85.0

SUFFIXES = (".png", ".jpg", ".jpeg", ".exr")


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return bool(_images(root)) and _partner(root, _images(root)[0], "depth") is not None


def read(root: Path, options: ScanOptions) -> Scan:
    """The photograph with its maps.

    Raises:
        InputError: there are several photographs and none is named, or no depth.
    """
    image = chosen(_images(root), root, options)
    depth = _partner(root, image, "depth")
    if depth is None:
        remedy = "Predict depth with any method, and write it as EXR beside the photograph."
        raise InputError(root, expected="predicted depth (depth.exr)", found="none", remedy=remedy)
    unit = options.depth_unit
    if unit is None:
        stored = read_depth_image(DepthImage(depth, 1.0))
        unit = 1.0 / float(np.nanmedian(stored)) if np.isfinite(stored).any() else 1.0
    field = options.fov or USUAL_FIELD
    lens = lens_by_field(image, field)
    # A network's pixels may have another shape; the field is the same.
    predicted = DepthImage(depth, unit, lens.resized(*size_of(depth)))
    frame = ScanFrame(image, lens, level_pose(), predicted, _partner(root, image, "albedo"))
    scale = "of median depth 1, not in metres" if options.depth_unit is None else "by ScanOptions.depth_unit"
    notes = (f"a field of view of {field:g}° is taken for granted (ScanOptions.fov)", f"lengths are {scale}")
    return Scan("iid", image, (), (frame,), options.camera_axes(AXES), notes)


def _images(root: Path) -> list[Path]:
    beside = [path for suffix in SUFFIXES if (path := root / f"im{suffix}").is_file()]
    inside = sorted((root / "im").iterdir()) if (root / "im").is_dir() else []
    return beside or [path for path in inside if path.suffix.lower() in SUFFIXES]


def _partner(root: Path, image: Path, kind: str) -> Path | None:
    """The map of this kind that belongs to an image."""
    stem = root / kind if image.parent == root else root / kind / image.stem
    places = (stem.with_name(f"{stem.name}{suffix}") for suffix in (".exr", ".png"))
    return next((path for path in places if path.is_file()), None)
