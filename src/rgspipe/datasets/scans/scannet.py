"""ScanNet: `color/N.jpg`, `depth/N.png` in millimetres, `pose/N.txt` camera-to-world with OpenCV axes, `intrinsic/`.

Frames whose pose is infinite are those that tracking lost: they are left out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.display_image import FORMATS
from rgspipe.datasets.json_file import shown
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import size_of
from rgspipe.datasets.scans.poses import placed, read_numbers
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "color/, pose/ and intrinsic/"

MILLIMETRE = 1e-3

#: Entries of a camera's place beside the other one's that are next to nothing: a millimetre, a milliradian.
BESIDE = 1e-3


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return all((root / name).is_dir() for name in ("color", "pose", "intrinsic"))


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all frames that were tracked.

    Raises:
        InputError: no frames, broken files, poses that are not rigid, or cameras of depth and colour in two places.
    """
    images = sorted(
        (path for path in (root / "color").iterdir() if path.suffix.lower() in FORMATS and path.stem.isdecimal()),
        key=lambda path: int(path.stem),
    )
    poses = [read_numbers(root / "pose" / f"{image.stem}.txt", 4, "a camera-to-world matrix") for image in images]
    tracked = [(image, pose) for image, pose in zip(images, poses, strict=True) if np.isfinite(pose).all()]
    if not tracked:
        found = f"{len(images)} images, none with a finite pose"
        raise InputError(
            root / "color", expected="frames that were tracked", found=found, remedy="Export the scan anew."
        )
    _check_one_place(root)
    colour = _lens(root / "intrinsic" / "intrinsic_color.txt", tracked[0][0])
    frames = tuple(_frame(root, image, pose, colour, options) for image, pose in tracked)
    lost = len(images) - len(tracked)
    texts = tuple(root / "pose" / f"{image.stem}.txt" for image in images)
    notes = (f"{lost} of {len(images)} frames without a pose are left out",) if lost else ()
    texts += tuple(sorted((root / "intrinsic").glob("*.txt")))
    return Scan("scannet", root / "pose", texts, frames, options.camera_axes(AXES), notes)


def _frame(root: Path, image: Path, matrix: np.ndarray, lens: Lens, options: ScanOptions) -> ScanFrame:
    where = root / "pose" / f"{image.stem}.txt"
    if matrix.shape != (4, 4):
        raise InputError(where, expected="4 lines", found=f"{len(matrix)}", remedy="Export the scan anew.")
    depth, own = root / "depth" / f"{image.stem}.png", root / "intrinsic" / "intrinsic_depth.txt"
    unit = MILLIMETRE if options.depth_unit is None else options.depth_unit
    measured = None
    if depth.is_file():
        measured = DepthImage(depth, unit, _lens(own, depth) if own.is_file() else None)
    return ScanFrame(image, lens, placed(matrix, where, options, AXES), measured)


def _check_one_place(root: Path) -> None:
    """Depth is taken along the rays of the photograph, so that both cameras must be where the pose is."""
    for path in (root / "intrinsic" / f"extrinsic_{name}.txt" for name in ("color", "depth")):
        if path.is_file() and (root / "depth").is_dir():
            matrix = read_numbers(path, 4, "extrinsics")
            if matrix.shape != (4, 4) or not np.abs(matrix - np.eye(4)).max() <= BESIDE:  # also where it is NaN
                raise InputError(
                    path,
                    expected="the identity: cameras of depth and colour in one place",
                    found=shown(matrix.tolist()),
                    remedy="Bring depth to the colour camera, and remove this file; or go without depth/.",
                )


def _lens(path: Path, image: Path) -> Lens:
    matrix = read_numbers(path, 4, "intrinsics")
    if len(matrix) < 3:
        raise InputError(path, expected="3 or 4 lines of intrinsics", found=f"{len(matrix)}", remedy="Write it anew.")
    width, height = size_of(image)
    # Pixel centres are whole numbers there.
    return Lens(matrix[0, 0], matrix[1, 1], matrix[0, 2] + 0.5, matrix[1, 2] + 0.5, width, height)
