"""Apple's ARKitScenes: `lowres_wide/ID_TIME.png`, `lowres_depth/` in millimetres, `confidence/`, `lowres_wide.traj`.

A line of the last has a time, an axis times an angle [rad] and a translation, which take the world to the camera, with
OpenCV axes. `lowres_wide_intrinsics/ID_TIME.pincam` has width, height, fx, fy, cx and cy. All lie in the folder of a
video, or in `ID_frames/` below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rgspipe.datasets.scans.frame import DepthImage, Lens, Numbers, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import placed, read_numbers
from rgspipe.datasets.scans.timed import nearest
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "lowres_wide/ and lowres_wide.traj, or ID_frames/ with these"

IMAGES, DEPTHS, CONFIDENCES, LENSES, POSES = (
    "lowres_wide",
    "lowres_depth",
    "confidence",
    "lowres_wide_intrinsics",
    "lowres_wide.traj",
)

MILLIMETRE = 1e-3

#: Seconds that belong together: times are rounded to milliseconds, in names otherwise than in the list of poses.
TOGETHER = 0.005


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return bool(_folders(root))


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all photographs that have a pose at their time.

    Raises:
        InputError: several videos, broken files, photographs without poses or intrinsics, or poses that are not rigid.
    """
    folders = _folders(root)
    if len(folders) != 1:
        found = f"{len(folders)}: {', '.join(folder.name for folder in folders)}"
        raise InputError(root, expected="one video", found=found, remedy="Give the folder of one of them.")
    (folder,) = folders
    path, images, lenses = folder / POSES, _dated(folder / IMAGES, ".png"), _dated(folder / LENSES, ".pincam")
    poses = read_numbers(path, 7, "times, rotations and translations")
    times = np.array([time for time, _ in images])
    chosen = nearest(poses[:, 0], times, TOGETHER)
    stated = nearest(np.array([time for time, _ in lenses]), times, TOGETHER)
    frames = []
    for (_, image), pose, lens in zip(images, chosen, stated, strict=True):
        if pose is not None:
            matrix = placed(_pose(poses[pose]), f"{path}: time {poses[pose, 0]:.3f}", options, AXES)
            frames.append(ScanFrame(image, _lens(image, lenses, lens), matrix, _depth(folder, image, options)))
    if not frames:
        found = f"{len(images)} photographs, none of them within {TOGETHER:g} s of one of {len(poses)} poses"
        raise InputError(path, expected="poses at the times of the photographs", found=found, remedy="Copy all files.")
    lost = len(images) - len(frames)
    notes = (f"{lost} of {len(images)} photographs without a pose are left out",) if lost else ()
    sources = (path, *(file for _, file in lenses))
    return Scan("arkitscenes", path, sources, tuple(frames), options.camera_axes(AXES), notes)


def _folders(root: Path) -> list[Path]:
    folders = [root, *sorted(root.glob("*_frames"))]
    return [folder for folder in folders if (folder / POSES).is_file() and (folder / IMAGES).is_dir()]


def _dated(folder: Path, suffix: str) -> list[tuple[float, Path]]:
    """Files with the times in their names, in the order of these."""
    found = []
    for path in sorted(folder.glob(f"*{suffix}")):
        number = path.stem.rpartition("_")[2]
        if number.replace(".", "", 1).isdecimal():
            found.append((float(number), path))
    return sorted(found)


def _pose(row: Numbers) -> Numbers:
    """(4, 4) camera-to-world of time, rotation and translation."""
    matrix = np.eye(4)
    if not np.isfinite(row).all():
        return matrix * np.nan
    rotation = Rotation.from_rotvec(row[1:4]).as_matrix().T
    matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ row[4:]
    return matrix


def _lens(image: Path, lenses: Sequence[tuple[float, Path]], chosen: int | None) -> Lens:
    if chosen is None:
        path = image.parent.with_name(LENSES) / f"{image.stem}.pincam"
        raise InputError(path, expected="intrinsics at the time of the photograph", found="none", remedy="Copy it.")
    width, height, fx, fy, cx, cy = read_numbers(lenses[chosen][1], 6, "width, height, fx, fy, cx, cy")[0].tolist()
    for size in (width, height):
        if not (np.isfinite(size) and size == int(size)):
            expected, found = "whole numbers of pixels", f"{size:g}"
            raise InputError(lenses[chosen][1], expected=expected, found=found, remedy="Copy it anew.")
    return Lens(fx, fy, cx, cy, int(width), int(height))


def _depth(folder: Path, image: Path, options: ScanOptions) -> DepthImage | None:
    depth, confidence = (folder / name / image.name for name in (DEPTHS, CONFIDENCES))
    unit = MILLIMETRE if options.depth_unit is None else options.depth_unit
    return DepthImage(depth, unit, confidence=confidence if confidence.is_file() else None) if depth.is_file() else None
