"""Cameras of a scene's own file, by name: images that the user rendered through them can be targets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from torch import Tensor

from rgspipe.datasets.input_file import is_there
from rgspipe.datasets.json_file import numbers, read_json, required, shown
from rgspipe.datasets.limits import LARGEST
from rgspipe.datasets.rigid_pose import rigid_pose
from rgspipe.errors import InputError
from rgspipe.scene import Camera
from rgspipe.scene.camera import longest_focal
from rgspipe.store.files import write_json

VERSION = 1

#: The shortest focal length, in sides of the image.
SHORTEST = 1e-6

#: The side of an image that a lens is stated for.
Side = Literal["longer", "width", "height"]


@dataclass(frozen=True)
class NamedCamera:
    """A perspective camera that does not say how many pixels its images have.

    Attributes:
        pose: (4, 4) float64 camera-to-world, scene units, OpenGL axes.
        focal: focal length over the length of `side`.
        side: of the image.
        shift: of the image to the right and up, over the length of `side`.
    """

    pose: Tensor
    focal: float
    side: Side = "longer"
    shift: tuple[float, float] = (0.0, 0.0)

    def of_image(self, width: int, height: int) -> Camera:
        """The camera of an image of this size."""
        length = {"longer": max(width, height), "width": width, "height": height}[self.side]
        cx, cy = 0.5 * width - self.shift[0] * length, 0.5 * height + self.shift[1] * length
        return Camera(self.pose, self.focal * length, self.focal * length, cx, cy, width, height)


def write_cameras(path: Path, cameras: Mapping[str, NamedCamera]) -> None:
    """Write a file of cameras by name."""
    entries = {
        name: {
            "transform_matrix": camera.pose.tolist(),
            "focal": camera.focal,
            "side": camera.side,
            "shift": [*camera.shift],
        }
        for name, camera in cameras.items()
    }
    write_json(path, {"version": VERSION, "cameras": entries})


def read_camera(path: Path, name: str) -> NamedCamera:
    """One of the cameras of a file.

    Raises:
        InputError: no such file, none of that name, or a broken one.
    """
    if not (is_there(path) and path.is_file()):
        remedy = "Check the path; of a .blend file, the stage generate_dataset writes cameras.json beside its images."
        raise InputError(path, expected="cameras by name", found="no such file", remedy=remedy)
    cameras = required(read_json(path, "cameras by name"), "cameras", path)
    if not isinstance(cameras, dict) or not isinstance(cameras.get(name), dict):
        there = ", ".join(cameras) if isinstance(cameras, dict) else shown(cameras)
        raise InputError(path, expected=f'a camera "{name}"', found=there or "none", remedy="Name one of these.")
    place = f"{path}: cameras.{name}"
    fields = cameras[name]
    pose = rigid_pose(required(fields, "transform_matrix", place), f"{place}.transform_matrix")
    [focal] = numbers([required(fields, "focal", place)], 1, place, "focal")
    shift = numbers(required(fields, "shift", place), 2, place, "shift")
    side = required(fields, "side", place)
    if focal < SHORTEST or side not in get_args(Side):
        expected = f'"focal" of at least {SHORTEST:g} and "side" one of {", ".join(get_args(Side))}'
        raise InputError(place, expected=expected, found=f"{focal:g}, {shown(side)}", remedy="Correct them.")
    if focal > longest_focal(1) or max(abs(value) for value in shift) > LARGEST:
        expected = f'"focal" of at most {longest_focal(1):g}, and "shift" of {LARGEST:g}'
        found = f"{focal:g}, {shift[0]:g}, {shift[1]:g}"
        raise InputError(place, expected=expected, found=found, remedy="Correct them.")
    return NamedCamera(pose, focal, side, (shift[0], shift[1]))
