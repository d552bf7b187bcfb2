"""OpenRooms: `cam.txt`, `im_N.hdr` (or .png), `imdepth_N.dat`, `imbaseColor_N.png`.

`cam.txt` has a count and then three lines a camera: its origin, the point that it looks at, and what is up. Depth is
in the scene's unit, along the axis; the .dat begins with height and width.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.reading_limits import reading_limits
from rgspipe.datasets.scans.frame import DepthImage, Numbers, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import placed
from rgspipe.datasets.scans.single import lens_by_field
from rgspipe.errors import InputError
from rgspipe.scene import look_at

#: Of the cameras, as their three points make them.
AXES = "opengl"

WANTED = "cam.txt and im_N.hdr with imdepth_N.dat"

#: Degrees across, of the cameras of the renderings: ScanNet's, 2 atan(320 / 577.87).
USUAL_FIELD = 57.95

#: Where a camera looks must be at least so far from its place, and `up` not along that.
LEAST_LENGTH, LEAST_ACROSS = 1e-6, 1e-3


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return (root / "cam.txt").is_file() and bool(_images(root))


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all images.

    Raises:
        InputError: broken files, or an image without a camera.
    """
    path = root / "cam.txt"
    cameras, images = _cameras(path), _images(root)
    if len(images) > len(cameras) or max(_number(image) for image in images) > len(cameras):
        found = f"{len(cameras)} cameras and {len(images)} images, the last {images[-1].name}"
        raise InputError(path, expected="a camera for each image", found=found, remedy="Copy all files.")
    field, unit = options.fov or USUAL_FIELD, 1.0 if options.depth_unit is None else options.depth_unit
    frames = []
    for image in images:
        number = _number(image)
        depth, albedo = root / f"imdepth_{number}.dat", root / f"imbaseColor_{number}.png"
        frames.append(
            ScanFrame(
                image,
                lens_by_field(image, field),
                placed(cameras[number - 1], f"{path}: camera {number}", options, AXES),
                DepthImage(depth, unit) if depth.is_file() else None,
                albedo if albedo.is_file() else None,
            )
        )
    notes = (f"a field of view of {field:g}° is taken for granted (ScanOptions.fov)",)
    return Scan("openrooms", path, (path,), tuple(frames), options.camera_axes(AXES), notes)


def _images(root: Path) -> list[Path]:
    """By number; of an image in both formats the one that holds light."""
    found = {}
    for suffix in (".png", ".hdr"):
        found |= {_number(path): path for path in root.glob(f"im_*{suffix}") if path.stem[3:].isdecimal()}
    return [found[number] for number in sorted(found) if number >= 1]


def _number(image: Path) -> int:
    return int(image.stem[3:])


def _cameras(path: Path) -> list[Numbers]:
    """(4, 4) camera-to-world transforms with OpenGL axes."""
    rows = list(_rows(path))
    if len(rows) % 3 or not rows:
        found = f"{len(rows)} lines of three numbers"
        raise InputError(path, expected="three lines a camera", found=found, remedy="Copy it anew.")
    return [_camera(f"{path}: camera {k + 1}", *rows[3 * k : 3 * k + 3]) for k in range(len(rows) // 3)]


def _rows(path: Path) -> Iterator[Numbers]:
    """Lines of three numbers; a first line with one says how many cameras they are of."""
    text = input_file(path, "cameras of OpenRooms", most_bytes=reading_limits().text_bytes).read_text(
        "utf-8-sig", "replace"
    )
    stated, count = None, 0
    for index, line in enumerate(line for line in text.splitlines() if line.strip()):
        try:
            values = np.array([float(word) for word in line.split()])
        except ValueError:
            values = np.zeros(0)
        if index == 0 and len(values) == 1:
            stated = values[0]
            continue
        if len(values) != 3 or not np.isfinite(values).all():
            found = repr(line[:60])
            raise InputError(path, expected="lines of three finite numbers", found=found, remedy="Copy it anew.")
        count += 1
        yield values
    if stated is not None and count != 3 * stated:
        found = f"{count} lines of them"
        raise InputError(path, expected=f"{stated:g} cameras of three lines", found=found, remedy="Copy it anew.")


def _camera(where: str, origin: Numbers, target: Numbers, up: Numbers) -> Numbers:
    ahead = target - origin
    across = np.linalg.norm(np.cross(ahead, up))
    if not across > LEAST_ACROSS * np.linalg.norm(ahead) * np.linalg.norm(up) > LEAST_LENGTH * LEAST_ACROSS:
        found = f"origin {origin.tolist()}, target {target.tolist()}, up {up.tolist()}"
        raise InputError(where, expected="a direction, and another that is up", found=found, remedy="Correct it.")
    return look_at(origin, target, up).double().numpy()
