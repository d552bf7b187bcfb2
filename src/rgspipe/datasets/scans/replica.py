"""Replica as NICE-SLAM has it: `traj.txt` (16 numbers a frame), `results/` with images and depth, `cam_params.json`.

Or as Semantic-NeRF and vMAP have it: `traj_w_c.txt`, `rgb/rgb_N.png` and `depth/depth_N.png` in millimetres, N counted
from 0 through the poses.
"""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.json_file import numbers, read_json, required, whole
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import placed, read_numbers
from rgspipe.datasets.scans.single import lens_by_field
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opencv"

WANTED = "traj.txt and results/, or traj_w_c.txt and rgb/"

#: Of Semantic-NeRF's layout: its poses, degrees across, and metres of 1 in a depth image.
NUMBERED, FIELD, MILLIMETRE = "traj_w_c.txt", 90.0, 1e-3

#: The rendered frames' camera and steps of depth a metre, where no cam_params.json says so.
USUAL = {"w": 1200.0, "h": 680.0, "fx": 600.0, "fy": 600.0, "cx": 599.5, "cy": 339.5, "scale": 6553.5}


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    pairs = (("traj.txt", "results"), (NUMBERED, "rgb"))
    return any((root / poses).is_file() and (root / images).is_dir() for poses, images in pairs)


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all frames.

    Raises:
        InputError: as many poses as images are wanted; broken files; poses that are not rigid.
    """
    path = root / "traj.txt"
    if not path.is_file():
        return _numbered(root, options)
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


def _numbered(root: Path, options: ScanOptions) -> Scan:
    """The cameras of frames that have their numbers in their names."""
    path = root / NUMBERED
    poses = read_numbers(path, 16, "camera-to-world matrices").reshape(-1, 4, 4)
    found = ((path.stem.removeprefix("rgb_"), path) for path in (root / "rgb").glob("rgb_*.png"))
    images = {int(number): path for number, path in found if number.isdecimal()}
    if not images or max(images) >= len(poses):
        numbers = f"{len(poses)} poses, and images up to {max(images, default=-1)}"
        raise InputError(path, expected="a pose for each rgb/rgb_N.png", found=numbers, remedy="Copy all files.")
    field, unit = options.fov or FIELD, MILLIMETRE if options.depth_unit is None else options.depth_unit
    lens = lens_by_field(images[min(images)], field)
    frames = []
    for number, image in sorted(images.items()):
        depth, pose = root / f"depth/depth_{number}.png", placed(poses[number], f"{path}: {number}", options, AXES)
        frames.append(ScanFrame(image, lens, pose, DepthImage(depth, unit) if depth.is_file() else None))
    notes = (f"a field of view of {field:g}° is taken for granted (ScanOptions.fov)",)
    return Scan("replica", path, (path,), tuple(frames), options.camera_axes(AXES), notes)


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
