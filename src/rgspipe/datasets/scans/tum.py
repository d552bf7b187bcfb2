"""TUM's RGB-D benchmark: lists of photographs and depth by time, `rgb.txt` and `depth.txt`, and `groundtruth.txt`.

A line of the last has a time, a place and a quaternion x y z w, camera-to-world with OpenCV axes. Depth lies on the
pixels of the photographs, in steps of 1/5000 m. `calibration.txt` (fx fy cx cy) is that of ETH3D's SLAM benchmark; of
TUM's own sequences names of folders tell the camera.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import shown
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.datasets.scans.frame import DepthImage, Lens, Numbers, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import size_of
from rgspipe.datasets.scans.poses import from_quaternion, placed, read_numbers
from rgspipe.datasets.scans.single import lens_by_field
from rgspipe.datasets.scans.timed import nearest
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "rgb.txt and groundtruth.txt, with depth.txt"
PHOTOGRAPHS, DEPTHS, POSES, CALIBRATION = "rgb.txt", "depth.txt", "groundtruth.txt", "calibration.txt"

#: Metres of 1 in a depth image, seconds that belong together (as of TUM's associate.py), and how far a quaternion's
#: length may be from 1: files have four digits.
STEP, TOGETHER, UNIT_LENGTH = 1.0 / 5000.0, 0.02, 0.01

#: fx, fy, cx, cy of 640 × 480 pixels: of the third camera, whose images are without distortion, and what the
#: benchmark recommends for the others, as their depth was put on the photographs' pixels by these.
FREIBURG, SIZE = re.compile("freiburg([123])"), (640, 480)
RECOMMENDED = {"1": (525.0, 525.0, 319.5, 239.5), "2": (525.0, 525.0, 319.5, 239.5), "3": (535.4, 539.2, 320.1, 247.6)}


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return (root / PHOTOGRAPHS).is_file() and (root / POSES).is_file()


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all photographs that have a pose at their time.

    Raises:
        InputError: broken files, no photograph with a pose, no intrinsics, or poses that are not rigid.
    """
    path, lists = root / POSES, [root / name for name in (PHOTOGRAPHS, DEPTHS)]
    poses = read_numbers(path, 8, "times, places and quaternions")
    (times, images), (depth_times, depths) = (_listed(one) if one.is_file() else (np.zeros(0), []) for one in lists)
    chosen = nearest(poses[:, 0], times, TOGETHER)
    if all(index is None for index in chosen):
        found = f"{len(images)} photographs, none of them within {TOGETHER:g} s of one of {len(poses)} poses"
        raise InputError(path, expected="poses at the times of the photographs", found=found, remedy="Copy all files.")
    lens, note = _lens(root, root / images[0], options)
    unit = STEP if options.depth_unit is None else options.depth_unit
    frames = []
    for image, index, depth in zip(images, chosen, nearest(depth_times, times, TOGETHER), strict=True):
        if index is not None:
            pose = placed(_pose(poses[index], path), f"{path}: time {poses[index, 0]:.6f}", options, AXES)
            measured = None if depth is None else DepthImage(root / depths[depth], unit)
            frames.append(ScanFrame(root / image, lens, pose, measured))
    lost = len(images) - len(frames)
    notes = (note, *([f"{lost} of {len(images)} photographs without a pose are left out"] if lost else []))
    sources = (path, *(one for one in (*lists, root / CALIBRATION) if one.is_file()))
    return Scan("tum", path, sources, tuple(frames), options.camera_axes(AXES), notes)


@timed
def _listed(path: Path) -> tuple[Numbers, list[str]]:
    """(N,) times and names of files, in their order."""
    text = input_file(path, "times and files", most_bytes=reading_limits().text_bytes).read_text("utf-8-sig", "replace")
    rows = [line.split(maxsplit=1) for line in text.splitlines() if line.strip() and not line.startswith("#")]
    try:
        times, names = np.array([float(row[0]) for row in rows]), [row[1].strip() for row in rows]
        if not (rows and np.isfinite(times).all()):
            raise ValueError("no times")
    except (ValueError, IndexError):
        found, remedy = "other text", "Copy it anew."
        raise InputError(path, expected="a time and a file a line", found=found, remedy=remedy) from None
    return times, names


def _pose(row: Numbers, path: Path) -> Numbers:
    """(4, 4) of time, place, and quaternion (x, y, z, w)."""
    x, y, z, w = row[4:]
    if not abs(np.linalg.norm(row[4:]) - 1.0) <= UNIT_LENGTH:  # also where it is NaN
        expected, found = "a time, x y z, and a quaternion x y z w of length 1", shown(row.tolist())
        raise InputError(path, expected=expected, found=found, remedy="Write it as TUM's benchmark does.")
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = from_quaternion(np.array([w, x, y, z])), row[1:4]
    return matrix


def _lens(root: Path, image: Path, options: ScanOptions) -> tuple[Lens, str]:
    """The lens of all photographs, and what is said of it."""
    if options.fov is not None:
        return lens_by_field(image, options.fov), f"the field of view is {options.fov:g}°, by ScanOptions.fov"
    named, path = FREIBURG.search(root.resolve().name), root / CALIBRATION
    if path.is_file():
        values, size = read_numbers(path, 4, "fx fy cx cy")[0].tolist(), size_of(image)
        note = f"intrinsics are those of {CALIBRATION}, without distortion"
    elif named is not None:
        values, size = RECOMMENDED[named[1]], SIZE
        note = f"intrinsics are those that the benchmark recommends for its camera freiburg{named[1]}"
    else:
        raise InputError(
            root,
            expected=f"intrinsics of the photographs: {CALIBRATION} (fx fy cx cy), or a folder of TUM's own name",
            found=f"neither, in a folder of the name {root.resolve().name}",
            remedy=f"Write {CALIBRATION}, name the folder as it was (rgbd_dataset_freiburg1_desk), or say "
            "ScanOptions(fov=DEGREES).",
        )
    fx, fy, cx, cy = values
    # Pixel centres are whole numbers there.
    return Lens(fx, fy, cx + 0.5, cy + 0.5, *size), note
