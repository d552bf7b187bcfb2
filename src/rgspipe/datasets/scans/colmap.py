"""COLMAP: a sparse model as text or binary, `images/`, and depth maps, which it does not make by itself.

Its poses take the world to the camera, with OpenCV axes. Its unit is its own: without depth that was measured, a scene
has no metres, and without any depth there are no surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rgspipe.datasets.input_file import is_there
from rgspipe.datasets.scans.colmap_model import ColmapImage, read_cameras, read_images
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import from_quaternion, placed
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "sparse/0/ (or sparse/, or the folder itself) with cameras and images, .bin or .txt"

#: Where a model may be, and photographs: as large as can be had, as datasets have them in smaller copies.
MODELS, IMAGES = ("sparse/0", "sparse", "."), ("images", ".", "images_2", "images_4", "images_8")

#: Where depth of a photograph may be; {name} is that of its file, {stem} without suffix.
DEPTHS = (
    "depth/{stem}.png",
    "depth/{stem}.exr",
    "depths/{stem}.png",
    "depths/{stem}.exr",
    "stereo/depth_maps/{name}.geometric.bin",
    "stereo/depth_maps/{name}.photometric.bin",
)

MILLIMETRE = 1e-3


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return _model(root) is not None


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all photographs.

    Raises:
        InputError: broken files, or a lens that is not known.
    """
    found = _model(root)
    if found is None:
        raise InputError(root, expected=WANTED, found="no model", remedy="Run colmap mapper, or correct the path.")
    cameras_path, images_path = found
    cameras, photographs = read_cameras(cameras_path), read_images(images_path)
    folder = next((root / name for name in IMAGES if is_there(root / name / photographs[0].name)), root / IMAGES[0])
    # The order of the file is that of registration.
    ordered = sorted(photographs, key=lambda one: one.name)
    frames = tuple(_frame(one, cameras, root, folder, images_path, options) for one in ordered)
    unit = "lengths are in the model's own unit, which is metres only if it was scaled (ScanOptions.pose_unit)"
    return Scan("colmap", images_path, (cameras_path, images_path), frames, options.camera_axes(AXES), (unit,))


def _model(root: Path) -> tuple[Path, Path] | None:
    """Cameras and images of the model."""
    for place in MODELS:
        for suffix in (".bin", ".txt"):
            cameras, images = (root / place / f"{name}{suffix}" for name in ("cameras", "images"))
            if cameras.is_file() and images.is_file():
                return cameras, images
    return None


def _frame(
    photograph: ColmapImage, cameras: Mapping[int, Lens], root: Path, folder: Path, where: Path, options: ScanOptions
) -> ScanFrame:
    if photograph.camera not in cameras:
        found = f"camera {photograph.camera} of {photograph.name}, which the model lacks"
        raise InputError(where, expected="a camera for each image", found=found, remedy="Copy the whole model.")
    matrix = np.eye(4)
    rotation = from_quaternion(photograph.quaternion).T
    matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ photograph.translation
    return ScanFrame(
        image=folder / photograph.name,
        lens=cameras[photograph.camera],
        pose=placed(matrix, f"{where}: {photograph.name}", options, AXES),
        depth=_depth(root, photograph.name, options),
        size_stated=True,
    )


def _depth(root: Path, name: str, options: ScanOptions) -> DepthImage | None:
    stem = Path(name).with_suffix("").as_posix()
    path = next((path for place in DEPTHS if is_there(path := root / place.format(name=name, stem=stem))), None)
    if path is None:
        return None
    usual = MILLIMETRE if path.suffix == ".png" else 1.0
    return DepthImage(path, usual if options.depth_unit is None else options.depth_unit)
