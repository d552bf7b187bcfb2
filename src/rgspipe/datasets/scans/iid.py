"""One photograph with what a network predicts of it, as Intrinsic Image Diffusion writes it: image, albedo, depth.

Either folders `im/ albedo/ depth/` with files of one name, or the files im, albedo and depth in one folder. There is
no camera: it is level, at the origin, looks along +y, and its field of view is a setting. Predicted depth has no unit:
its median is made 1.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import read_depth_image, size_of
from rgspipe.errors import InputError
from rgspipe.scene import look_at

#: Of the cameras.
AXES = "opengl"

WANTED = "im.png (or im/NAME.png) with albedo and depth beside it"

SUFFIXES = (".png", ".jpg", ".jpeg", ".exr")


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return bool(_images(root)) and _partner(root, _images(root)[0], "depth") is not None


def read(root: Path, options: ScanOptions) -> Scan:
    """The photograph with its maps.

    Raises:
        InputError: there are several photographs, or no depth.
    """
    images = _images(root)
    if len(images) != 1:
        expected = "one photograph (im.png, or one file in im/): without poses several do not go together"
        remedy = "Move the one that is meant into a folder of its own, with its maps."
        raise InputError(root, expected=expected, found=f"{len(images)}", remedy=remedy)
    image = images[0]
    depth = _partner(root, image, "depth")
    if depth is None:
        remedy = "Predict depth with any method, and write it as EXR beside the photograph."
        raise InputError(root, expected="predicted depth (depth.exr)", found="none", remedy=remedy)
    unit = options.depth_unit
    if unit is None:
        stored = read_depth_image(DepthImage(depth, 1.0))
        unit = 1.0 / float(np.nanmedian(stored)) if np.isfinite(stored).any() else 1.0
    width, height = size_of(image)
    focal = 0.5 * width / np.tan(np.radians(0.5 * options.fov))
    lens = Lens(focal, focal, 0.5 * width, 0.5 * height, width, height)
    pose = look_at([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]).numpy()
    frame = ScanFrame(image, lens, pose, DepthImage(depth, unit), _partner(root, image, "albedo"))
    scale = "of median depth 1, not in metres" if options.depth_unit is None else "by scene.rgbd.depth_unit"
    notes = (f"a field of view of {options.fov:g}° is taken for granted (scene.rgbd.fov)", f"lengths are {scale}")
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
