"""The "frames" of a transforms file: paths, cameras and lights, checked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.frame_keys import check_frames
from rgspipe.datasets.image_names import SUFFIXES, image_named
from rgspipe.datasets.input_file import is_plain_name
from rgspipe.datasets.json_file import is_number, numbers, read_json, required, shown
from rgspipe.datasets.lens_keys import DISTORTION, OTHER_OPTICS, STRAIGHT, first_that_bends
from rgspipe.datasets.limits import STRONGEST
from rgspipe.datasets.named_cameras import read_camera
from rgspipe.datasets.pinhole_keys import ANGLES, KEYS, stated_intrinsics
from rgspipe.datasets.rigid_pose import check_place, refined_pose, rigid_pose
from rgspipe.errors import InputError
from rgspipe.scene import Camera
from rgspipe.scene.camera import longest_focal
from rgspipe.scene.lights import WATTS_PER_INTENSITY

#: The key of a camera by its name in the scene's own file, and that of the file that lists these.
CAMERA, CAMERAS = "camera", "cameras_path"

#: A principal point off the middle by more than ELSEWHERE of the half width, and by as much of the half height within
#: ALIKE, is that of an image of another size: lenses are off by some hundredths, and rarely by as much both ways.
ELSEWHERE, ALIKE = 0.1, 0.02

#: The shortest focal length, pixels.
SHORTEST = 1e-6


@dataclass(frozen=True)
class FrameEntry:
    """One frame as it stands in the file; the parts are checked when they are asked for.

    Attributes:
        transforms_path: the file, for errors.
        index: which frame of the file.
        fields: the frame's own keys.
        shared: the file's top-level keys, which hold for frames that do not say otherwise.
    """

    transforms_path: Path
    index: int
    fields: dict
    shared: dict

    @property
    def where(self) -> str:
        """The place, for errors."""
        return f"{self.transforms_path}: frames[{self.index}]"

    @property
    def image_path(self) -> Path:
        """The image; `file_ext` is added unless `file_path` has it already, see `image_named` where none is stated."""
        name, extension = self._text("file_path"), self.fields.get("file_ext", self.shared.get("file_ext"))
        if extension is None:
            return self._image(name)
        if not isinstance(extension, str):
            raise InputError(f"{self.where}.file_ext", expected="a suffix", found=repr(extension), remedy="Correct it.")
        extension = f".{extension}" if f".{extension.lower()}" in SUFFIXES else extension
        return self._image(name if name.endswith(extension) else name + extension)

    @property
    def depth_path(self) -> Path | None:
        """The depth image, if there is one."""
        return self._optional_path("depth_path")

    @property
    def normal_path(self) -> Path | None:
        """The normal image, if there is one."""
        return self._optional_path("normal_path")

    @property
    def albedo_path(self) -> Path | None:
        """The albedo image, if there is one."""
        return self._optional_path("albedo_path")

    @property
    def base_path(self) -> Path | None:
        """The same view with the lamps off, if there is one."""
        return self._optional_path("base_path")

    @property
    def mask_path(self) -> Path | None:
        """The image of which pixels count, if there is one."""
        return self._optional_path("mask_path")

    @property
    def emitter_path(self) -> Path | None:
        """The image of where lamps themselves are to be seen, if there is one."""
        return self._optional_path("emitter_path")

    @property
    def saturated_from(self) -> float | None:
        """Radiance from which on the image tells only that the scene is at least so bright, if the file says so.

        Raises:
            InputError: it is no number above 0.
        """
        value = self.fields.get("saturated_from")
        if value is not None and not (is_number(value) and value > 0):
            place = f"{self.where}.saturated_from"
            raise InputError(place, expected="radiance above 0", found=shown(value), remedy="Correct it.")
        return None if value is None else float(value)

    @property
    def lighting(self) -> str:
        """The name of the lamps that were on, or nothing.

        Raises:
            InputError: it is no plain name.
        """
        value = self.fields.get("lighting", "")
        if value != "" and not is_plain_name(value):
            place = f"{self.where}.lighting"
            raise InputError(place, expected="a plain name", found=shown(value), remedy="Correct it.")
        return value

    @property
    def files(self) -> list[Path]:
        """All images of the frame."""
        maps = (self.depth_path, self.normal_path, self.albedo_path, self.base_path, self.mask_path, self.emitter_path)
        named = [self.cameras_path] if CAMERA in self.fields else []
        return [self.image_path, *named, *(path for path in maps if path is not None)]

    @property
    def cameras_path(self) -> Path:
        """The file that has the frame's `camera`: the dataset's cameras.json, for one.

        Raises:
            InputError: none is named.
        """
        return self._path(self._text(CAMERAS, {**self.shared, **self.fields}))

    def camera(self, width: int, height: int) -> Camera:
        """The camera for an image of this size.

        Raises:
            InputError: no rigid transform, no intrinsics, or intrinsics of an image of another size.
        """
        self._refuse_distortion()
        if CAMERA in self.fields:
            return read_camera(self.cameras_path, self._text(CAMERA)).of_image(width, height)
        pose = self.pose()
        own = self.fields.keys() & {"camera_intrinsics", *ANGLES, *KEYS}
        holder = self.fields if own else self.shared
        if "camera_intrinsics" in holder:
            self._require_size(width, height)
            values = numbers(holder["camera_intrinsics"], 4, self.where, "camera_intrinsics")
            return self._camera_of(values, "camera_intrinsics", pose, width, height)
        stated = self.shared | self.fields
        values = stated_intrinsics(stated, width, height, self.where)
        if values is None:
            raise InputError(
                self.where,
                expected='"camera_angle_x" [rad] or "camera_intrinsics" [cx, cy, fx, fy], here or at the top',
                found="neither",
                remedy="Add one of them.",
            )
        keys = ", ".join(key for key in (*KEYS, *ANGLES) if key in stated)
        return self._camera_of(values, keys, pose, width, height)

    def _refuse_distortion(self) -> None:
        """Images of lenses that bend straight lines are not of the cameras that are known here."""
        stated = self.shared | self.fields
        key = first_that_bends(stated, (*DISTORTION, *OTHER_OPTICS))
        if key is None and stated.get("camera_model") not in (None, *STRAIGHT):
            key = "camera_model"
        if key is not None:
            raise InputError(
                f"{self.where}: {key}",
                expected="0: images without distortion" if key != "camera_model" else "a camera without distortion",
                found=shown(stated[key]),
                remedy="Undistort the images (colmap image_undistorter), and leave the key away.",
            )

    def refuse_other_world(self) -> None:
        """Refuse a target whose poses are in other axes, or another unit, than those of the scene.

        Raises:
            InputError: there is an `applied_transform` or an `applied_scale` other than 1.
        """
        rows = [[float(row == column) for column in range(4)] for row in range(4)]
        for key, nothing in (("applied_transform", (None, rows, rows[:3])), ("applied_scale", (None, 1))):
            if (value := self.shared.get(key)) not in nothing:
                raise InputError(
                    f"{self.transforms_path}: {key}",
                    expected="poses in the axes and the unit of the scene",
                    found=shown(value),
                    remedy="Write the poses as those of the training views are, and leave the key away.",
                )

    @property
    def names_light(self) -> bool:
        """Whether anything is said of the frame's light."""
        return bool((self.shared | self.fields).keys() & {"pl_pos", "pl_intensity"})

    def light(self) -> tuple[Tensor, Tensor]:
        """Position (3,) and intensity (3,) [W/sr] of the frame's light, float64; the file holds watts.

        Raises:
            InputError: "pl_pos" or "pl_intensity" is missing or impossible.
        """
        stated = self.shared | self.fields
        position = numbers(required(stated, "pl_pos", self.where), 3, self.where, "pl_pos")
        watts = required(stated, "pl_intensity", self.where)
        watts = numbers([watts] * 3 if is_number(watts) else watts, 3, self.where, "pl_intensity")
        if min(watts) < 0 or not 0 < max(watts) <= STRONGEST:
            expected = f"watts above 0, up to {STRONGEST:g}"
            raise InputError(f"{self.where}.pl_intensity", expected=expected, found=repr(watts), remedy="Correct it.")
        check_place(position, f"{self.where}.pl_pos")
        power = torch.tensor(watts, dtype=torch.float64)
        return torch.tensor(position, dtype=torch.float64), power / WATTS_PER_INTENSITY

    def _require_size(self, width: int, height: int) -> None:
        """Refuse an image of another size than is stated."""
        for key, expected in (("w", width), ("h", height)):
            stated = self.fields.get(key, self.shared.get(key, expected))
            if stated != expected:
                found = f"{width} × {height} pixels"
                raise InputError(
                    self.image_path, expected=f'"{key}": {stated!r} of {self.where}', found=found, remedy="Correct one."
                )

    def _camera_of(self, intrinsics: list[float], keys: str, pose: Tensor, width: int, height: int) -> Camera:
        """The camera of cx, cy, fx, fy under these keys, if an image of this size can have it."""
        cx, cy, fx, fy = intrinsics
        place = f"{self.where}.{keys}"
        longest = longest_focal(max(width, height))
        if min(fx, fy) < SHORTEST or max(fx, fy) > longest:
            expected = f"focal lengths in pixels, above 0 and up to {longest:g}"
            raise InputError(place, expected=expected, found=f"{fx:g}, {fy:g}", remedy="Correct them.")
        if abs(cx - 0.5 * width) > 0.25 * width or abs(cy - 0.5 * height) > 0.25 * height:
            raise InputError(
                self.image_path,
                expected=f"an image whose middle is near the principal point ({cx:g}, {cy:g}) of {place}",
                found=f"{width} × {height} pixels",
                remedy="Use intrinsics of this image size.",
            )
        across, down, stated = 2.0 * cx / width, 2.0 * cy / height, self.fields.keys() | self.shared.keys()
        if not {"w", "h"} <= stated and abs(across - down) < ALIKE and abs(across - 1.0) > ELSEWHERE:
            raise InputError(
                place,
                expected=f"those of an image of {width} × {height} pixels, as {self.image_path.name} is",
                found=f"the middle of one of {2.0 * cx:g} × {2.0 * cy:g}",
                remedy='Scale them to this size; of an image that is cropped like that, state its size ("w", "h").',
            )
        return Camera(pose, fx, fy, cx, cy, width, height)

    def pose(self) -> Tensor:
        """The (4, 4) float64 camera-to-world transform.

        Raises:
            InputError: it is missing or not rigid.
        """
        refined = refined_pose(self.fields, self.where)
        if refined is not None:
            return refined
        value = required(self.fields, "transform_matrix", self.where)
        return rigid_pose(value, f"{self.where}.transform_matrix")

    def _optional_path(self, key: str) -> Path | None:
        return self._image(self._text(key)) if key in self.fields else None

    def _image(self, name: str) -> Path:
        return image_named(self.transforms_path.parent, name)

    def _text(self, key: str, fields: dict | None = None) -> str:
        value = required(self.fields if fields is None else fields, key, self.where)
        if not isinstance(value, str) or not value:
            raise InputError(f"{self.where}.{key}", expected="a path", found=repr(value), remedy="Correct it.")
        return value

    def _path(self, name: str) -> Path:
        return self.transforms_path.parent / name


def read_entries(path: Path, what: str) -> list[FrameEntry]:
    """The frames of a transforms file, at least one.

    Raises:
        InputError: no such file, not JSON, no frames, or keys that were meant to be others.
    """
    content = read_json(path, what)
    frames = required(content, "frames", path)
    if not isinstance(frames, list) or not frames:
        raise InputError(
            path, expected='at least one frame under "frames"', found="none", remedy="Add frames with their images."
        )
    check_frames(frames, path)
    shared = {key: value for key, value in content.items() if key != "frames"}
    return [FrameEntry(path, index, frame, shared) for index, frame in enumerate(frames)]
