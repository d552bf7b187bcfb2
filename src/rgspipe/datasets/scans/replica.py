"""Replica as NICE-SLAM has it: `traj.txt` (16 numbers a frame), `results/` with images and depth, `cam_params.json`."""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.json_file import numbers, read_json, required, whole
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import placed, read_numbers
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "traj.txt and results/"

#: The rendered frames' camera and steps of depth a metre, where no cam_params.json says so.
USUAL = {"w": 1200.0, "h": 680.0, "fx": 600.0, "fy": 600.0, "cx": 599.5, "cy": 339.5, "scale": 6553.5}


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return (root / "traj.txt").is_file() and (root / "results").is_dir()


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all frames.

    Raises:
        InputError: as many poses as images are wanted; broken files; poses that are not rigid.
    """
    path = root / "traj.txt"
    poses = read_numbers(path, 16, "camera-to-world matrices").reshape(-1, 4, 4)
    images = sorted(path for path in (root / "results").glob("frame*") if path.suffix.lower() in (".jpg", ".png"))
    if len(images) != len(poses) or not images:
        found = f"{len(poses)} poses and {len(images)} images"
        raise InputError(path, expected="one pose for each results/frame*.jpg", found=found, remedy="Copy all files.")
    parameters = next(
        (file for file in (root / "cam_params.json", root.parent / "cam_params.json") if file.is_file()), None
    )
    lens, scale = _camera(parameters)
    unit = 1.0 / scale if options.depth_unit is None else options.depth_unit
    frames = []
    for index, (pose, image) in enumerate(zip(poses, images, strict=True)):
        depth = image.with_name(f"{image.stem.replace('frame', 'depth')}.png")
        pose = placed(pose, f"{path}: line {index + 1}", options, AXES)
        frames.append(ScanFrame(image, lens, pose, DepthImage(depth, unit) if depth.is_file() else None))
    return Scan(
        "replica", path, (path, *([parameters] if parameters else [])), tuple(frames), options.camera_axes(AXES)
    )


def _camera(path: Path | None) -> tuple[Lens, float]:
    """The lens, and steps of depth a metre."""
    content = USUAL if path is None else required(read_json(path, "the camera of Replica"), "camera", path)
    where = path or "cam_params.json"
    if not isinstance(content, dict):
        raise InputError(where, expected='"camera": {…}', found=repr(content), remedy="Correct it.")
    values = {key: numbers([required(content, key, where)], 1, where, key)[0] for key in USUAL}
    if values["scale"] <= 0.0:
        expected, found = "steps of depth a metre, above 0", f"{values['scale']:g}"
        remedy = "Correct it: Replica's own is 6553.5."
        raise InputError(f"{where}: camera.scale", expected=expected, found=found, remedy=remedy)
    # Pixel centres are whole numbers there.
    centre = values["cx"] + 0.5, values["cy"] + 0.5
    return Lens(values["fx"], values["fy"], *centre, *(whole(values[key], where, key) for key in "wh")), values["scale"]
