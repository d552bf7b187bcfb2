"""Microsoft's 7-Scenes: `frame-NNNNNN.color.png`, `.depth.png` in millimetres, `.pose.txt`, camera-to-world, OpenCV.

A folder is one sequence. Poses are those of the depth camera. Nobody calibrated the two cameras to each other: what is
taken for granted are the usual focal lengths of such a sensor, and both in one place.
"""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import placed, read_numbers
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "frame-000000.color.png, .depth.png and .pose.txt"

#: The kind of each file of a frame, after its name.
COLOUR, DEPTH, POSE = ".color.png", ".depth.png", ".pose.txt"

#: Of the depth camera, as the makers state it, and what those who use the photographs take these for.
DEPTH_LENS = Lens(585.0, 585.0, 320.0, 240.0, 640, 480)
COLOUR_LENS = Lens(525.0, 525.0, 320.0, 240.0, 640, 480)

MILLIMETRE = 1e-3


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return any(root.glob(f"frame-*{COLOUR}"))


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all frames of a sequence.

    Raises:
        InputError: broken files, or poses that are not rigid.
    """
    images = sorted(root.glob(f"frame-*{COLOUR}"))
    frames = tuple(_frame(image, options) for image in images)
    note = "the photographs' camera was not calibrated: 525 pixels of 640 are taken, in the depth camera's place"
    sources = tuple(_beside(image, POSE) for image in images)
    return Scan("7scenes", root, sources, frames, options.camera_axes(AXES), (note,))


def _frame(image: Path, options: ScanOptions) -> ScanFrame:
    depth, path = _beside(image, DEPTH), _beside(image, POSE)
    matrix = read_numbers(path, 4, "a camera-to-world matrix")
    if matrix.shape != (4, 4):
        raise InputError(path, expected="4 lines", found=f"{len(matrix)}", remedy="Copy it anew.")
    unit = MILLIMETRE if options.depth_unit is None else options.depth_unit
    measured = DepthImage(depth, unit, DEPTH_LENS) if depth.is_file() else None
    return ScanFrame(image, COLOUR_LENS, placed(matrix, path, options, AXES), measured)


def _beside(image: Path, kind: str) -> Path:
    return image.with_name(image.name.removesuffix(COLOUR) + kind)
