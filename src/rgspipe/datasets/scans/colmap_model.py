"""The two files of a COLMAP model that are needed, as text and as binary: cameras and images."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import shown
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.datasets.scans.frame import Lens, Numbers
from rgspipe.errors import InputError
from rgspipe.store.files import LONGEST_NAME

#: Camera models by COLMAP's numbers, with how many parameters each has; of the others no lens is known here.
MODELS = {0: ("SIMPLE_PINHOLE", 3), 1: ("PINHOLE", 4), 2: ("SIMPLE_RADIAL", 4), 3: ("RADIAL", 5), 4: ("OPENCV", 8)}
MODELS |= {5: ("OPENCV_FISHEYE", 8), 6: ("FULL_OPENCV", 12), 8: ("SIMPLE_RADIAL_FISHEYE", 4), 9: ("RADIAL_FISHEYE", 5)}
MODELS |= {14: ("SIMPLE_FISHEYE", 3), 15: ("FISHEYE", 4)}  # of COLMAP 4

#: Numbers of those, which have other distortion.
OTHERS = {7: "FOV", 10: "THIN_PRISM_FISHEYE", 11: "RAD_TAN_THIN_PRISM_FISHEYE"}

#: What helps against files that another program, or a person, wrote in another way than COLMAP.
REWRITE = "Write it as COLMAP does (colmap model_converter --output_type TXT)."

#: A quaternion shorter than this is none.
LEAST_NORM = 1e-6

Parts = TypeVar("Parts")


@dataclass(frozen=True, eq=False)
class ColmapImage:
    """An image of a model.

    Attributes:
        name: of its file.
        camera: the number of its camera.
        quaternion, translation: (w, x, y, z) and (3,) of the transform that takes the world to the camera.
    """

    name: str
    camera: int
    quaternion: Numbers
    translation: Numbers


def read_cameras(path: Path) -> dict[int, Lens]:
    """Lenses by number.

    Raises:
        InputError: a broken file, or a model with another kind of distortion.
    """
    return _whole(path, _binary_cameras if path.suffix == ".bin" else _text_cameras)


def read_images(path: Path) -> list[ColmapImage]:
    """All images, at least one.

    Raises:
        InputError: a broken file, or none.
    """
    photographs = _whole(path, _binary_images if path.suffix == ".bin" else _text_images)
    names = [one.name for one in photographs]
    if len(set(names)) < len(names):
        found = shown(next(name for name in names if names.count(name) > 1))
        raise InputError(path, expected="each image once", found=f"{found} twice", remedy="Run colmap mapper again.")
    if not photographs:
        raise InputError(path, expected="registered images", found="none", remedy="Run colmap mapper again.")
    return photographs


@timed
def _whole(path: Path, read: Callable[[Path, bytes], Parts]) -> Parts:
    try:
        return read(path, input_file(path, "a part of a COLMAP model", most_bytes=reading_limits().bytes).read_bytes())
    except InputError:
        raise
    except (struct.error, ValueError, IndexError, OverflowError) as error:
        found = f"other content, or half of it ({error})"
        raise InputError(path, expected="a part of a COLMAP model", found=found, remedy="Copy it anew.") from error


def _lens(path: Path, model: str, size: Sequence[int], values: Sequence[float]) -> Lens:
    parameters = dict(MODELS.values()).get(model)
    if parameters is None:
        raise InputError(
            path,
            expected=f"cameras of the models {', '.join(name for name, _ in MODELS.values())}",
            found=shown(model),
            remedy="Undistort the photographs (colmap image_undistorter) and give its output in the place of this.",
        )
    if len(values) != parameters:
        expected, remedy = f"{parameters} parameters of a camera of the model {model}", REWRITE
        raise InputError(path, expected=expected, found=f"{len(values)}", remedy=remedy)
    match model:
        case "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL":
            focal, cx, cy, *radial = values
            return Lens(focal, focal, cx, cy, *size, tuple(radial))
        case "PINHOLE":
            return Lens(*values, *size)
        case "OPENCV":
            fx, fy, cx, cy, k1, k2, p1, p2 = values
            return Lens(fx, fy, cx, cy, *size, (k1, k2), (p1, p2))
        case "FULL_OPENCV":
            fx, fy, cx, cy, k1, k2, p1, p2, k3, *rational = values
            return Lens(fx, fy, cx, cy, *size, (k1, k2, k3), (p1, p2), rational=tuple(rational))
        case "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE" | "SIMPLE_FISHEYE":
            focal, cx, cy, *radial = values
            return Lens(focal, focal, cx, cy, *size, tuple(radial), fisheye=True)
    return Lens(*values[:4], *size, tuple(values[4:]), fisheye=True)  # OPENCV_FISHEYE, FISHEYE


def _text_cameras(path: Path, content: bytes) -> dict[int, Lens]:
    found = {}
    for line in _lines(content):
        if line.strip():
            number, model, width, height, *values = line.split()
            if int(number) in found:
                raise ValueError(f"camera {number} twice")
            found[int(number)] = _lens(path, model, (int(width), int(height)), [float(value) for value in values])
    return found


def _binary_cameras(path: Path, content: bytes) -> dict[int, Lens]:
    (count,), place = struct.unpack_from("<Q", content), 8
    found = {}
    for _ in range(count):
        number, kind, width, height = struct.unpack_from("<iiQQ", content, place)
        model, parameters = MODELS.get(kind, (OTHERS.get(kind, f"number {kind}"), 0))
        values = struct.unpack_from(f"<{parameters}d", content, place + 24)
        if number in found:
            raise ValueError(f"camera {number} twice")
        found[number] = _lens(path, model, (width, height), values)
        place += 24 + 8 * parameters
    return found


def _text_images(path: Path, content: bytes) -> list[ColmapImage]:
    """Each image has a second line, of its points, which may be empty; the last one may lack it."""
    lines, found = iter(_lines(content)), []
    for line in lines:
        if line.strip():
            _, *values, camera, name = line.split(maxsplit=9)
            found.append(_photograph(name.strip(), int(camera), [float(value) for value in values]))
            _check_points(path, found[-1].name, next(lines, ""))
    return found


def _check_points(path: Path, name: str, line: str) -> None:
    """Refuse what is no line of points (column, row, number) below an image: it may be the next image's, left out."""
    try:
        whole = len([float(word) for word in line.split()]) % 3 == 0
    except ValueError:
        whole = False
    if not whole:
        expected = f"a line of points below that of {name}, which may be empty"
        raise InputError(path, expected=expected, found=shown(line[:60]), remedy=REWRITE)


def _binary_images(path: Path, content: bytes) -> list[ColmapImage]:
    (count,), place = struct.unpack_from("<Q", content), 8
    found = []
    for _ in range(count):
        _, *values, camera = struct.unpack_from("<i7di", content, place)
        place += 64
        end = content.index(b"\0", place)
        found.append(_photograph(content[place:end].decode(), camera, values))
        (points,) = struct.unpack_from("<Q", content, end + 1)
        place = end + 9 + 24 * points
    if place != len(content):
        raise ValueError(f"{len(content)} bytes, and images end at {place}")
    return found


def _photograph(name: str, camera: int, values: Sequence[float]) -> ColmapImage:
    numbers = np.array(values)
    if len(numbers) != 7 or not np.isfinite(numbers).all() or np.linalg.norm(numbers[:4]) < LEAST_NORM:
        raise ValueError(f"no pose of {shown(name)}")
    if not all(part.isprintable() and 0 < len(part.encode()) <= LONGEST_NAME for part in name.split("/")):
        raise ValueError(f"no name of an image: {shown(name)}")
    return ColmapImage(name, camera, numbers[:4], numbers[4:])


def _lines(content: bytes) -> list[str]:
    """Without comments; empty lines mean something."""
    return [line for line in content.decode("utf-8-sig").splitlines() if not line.startswith("#")]
