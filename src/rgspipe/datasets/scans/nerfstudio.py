"""nerfstudio: `transforms.json` with intrinsics, distortion and camera-to-world poses with OpenGL axes.

Poses may have been scaled and turned (`applied_scale`, `applied_transform`): the scale is undone, so that metres are
metres, the turn is kept.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from rgspipe.datasets.frames import FrameEntry, read_entries
from rgspipe.datasets.image_names import check_once, image_named
from rgspipe.datasets.json_file import is_number, shown, whole
from rgspipe.datasets.lens_keys import FISHEYE, OTHER_OPTICS, STRAIGHT, first_that_bends
from rgspipe.datasets.pinhole_keys import stated_intrinsics
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import size_of
from rgspipe.datasets.scans.poses import matrix_of, placed
from rgspipe.errors import InputError

TRANSFORMS = "transforms.json"
#: Of the cameras.
AXES = "opengl"

WANTED = "transforms.json"

#: Metres of 1 in a depth PNG, where the file does not say.
MILLIMETRE = 1e-3

#: Depth, and metres of 1 in it, as nerfstudio and as instant-ngp call them, which has none without the second.
DEPTHS = (("depth_file_path", "depth_unit_scale_factor"), ("depth_path", "integer_depth_scale"))

#: How many times as long as another one a unit of length may be.
MOST_UNITS = 1e9

#: A size that is given as text.
SIZE = re.compile("[0-9]{1,9}")

#: Which focal length stands over an angle.
FOCAL_OF = {"camera_angle_x": "fl_x", "camera_angle_y": "fl_y"}


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return (root / TRANSFORMS).is_file()


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all frames.

    Raises:
        InputError: missing keys, another camera model, or poses that are not rigid.
    """
    path = root / TRANSFORMS
    entries = read_entries(path, "the cameras of a nerfstudio capture")
    frames = tuple(_frame(entry, options) for entry in entries)
    check_once([frame.image for frame in frames], path)
    turned = "applied_transform" in entries[0].shared
    notes = ("the world's axes are those of the file, after its applied_transform",) if turned else ()
    return Scan("nerfstudio", path, (path,), frames, options.camera_axes(AXES), notes)


def _frame(entry: FrameEntry, options: ScanOptions) -> ScanFrame:
    where = f"{entry.where}.transform_matrix"
    if "transform_matrix" not in entry.fields:
        raise InputError(where, expected="a 4 × 4 matrix", found="no such key", remedy="Add it.")
    matrix = matrix_of(entry.fields["transform_matrix"], where)
    matrix[:3, 3] /= _unit(entry, "applied_scale", 1.0)
    return ScanFrame(
        image=_image(entry),
        lens=_lens(entry),
        pose=placed(matrix, where, options, AXES),
        depth=_depth(entry, options),
        mask=entry.transforms_path.parent / _text(entry, "mask_path") if _stated(entry, "mask_path") else None,
        size_stated={"w", "h"} <= entry.shared.keys() | entry.fields.keys(),
    )


def _lens(entry: FrameEntry) -> Lens:
    model = _value(entry, "camera_model")
    model = STRAIGHT[0] if model is None else model
    if model not in (*STRAIGHT, FISHEYE):
        raise InputError(
            f"{entry.where}: camera_model",
            expected=f"one of {', '.join((*STRAIGHT, FISHEYE))}",
            found=shown(model),
            remedy="Undistort the photographs first (colmap image_undistorter).",
        )
    fisheye = model == FISHEYE
    stated = entry.shared | entry.fields
    _refuse_other_optics(entry, stated, OTHER_OPTICS[:-1] if fisheye else OTHER_OPTICS)
    # Of a focal length nerfstudio asks for no angle beside it, which may be left of another size.
    stated = {key: value for key, value in stated.items() if FOCAL_OF.get(key) not in stated}
    stated |= {key: int(text) for key in ("w", "h") if SIZE.fullmatch(text := str(stated.get(key)))}
    sizes = [whole(stated[key], entry.where, key) if key in stated else None for key in ("w", "h")]
    width, height = size_of(_image(entry)) if None in sizes else sizes
    values = stated_intrinsics(stated, width, height, entry.where)
    if values is None:
        expected = '"fl_x" or "camera_angle_x", here or at the top'
        raise InputError(entry.where, expected=expected, found="neither", remedy="Add one of them.")
    cx, cy, fx, fy = values
    radial = tuple(_number(entry, key, 0.0) for key in ("k1", "k2", "k3", "k4"))
    # A fisheye lens has no such terms; files may hold those of another model.
    tangential = (0.0, 0.0) if fisheye else (_number(entry, "p1", 0.0), _number(entry, "p2", 0.0))
    return Lens(fx, fy, cx, cy, width, height, radial, tangential, fisheye)


def _image(entry: FrameEntry) -> Path:
    return image_named(entry.transforms_path.parent, _text(entry, "file_path"))


def _refuse_other_optics(entry: FrameEntry, stated: Mapping[str, object], keys: Sequence[str]) -> None:
    key = first_that_bends(stated, keys)
    if key is not None:
        raise InputError(
            f"{entry.where}: {key}",
            expected=f"0: lenses of k1 to k4, p1 and p2, or the camera_model {FISHEYE} with k1 to k4",
            found=shown(stated[key]),
            remedy="State the lens so, or undistort the photographs (colmap image_undistorter); remove the key.",
        )


def _depth(entry: FrameEntry, options: ScanOptions) -> DepthImage | None:
    own = not _stated(entry, DEPTHS[0][0])
    key, scale = DEPTHS[own]
    if not _stated(entry, key) or (own and _value(entry, scale) is None):
        return None
    path = image_named(entry.transforms_path.parent, _text(entry, key))
    default = 1.0 if path.suffix.lower() == ".exr" else MILLIMETRE
    stated = _unit(entry, scale, default)
    return DepthImage(path, stated if options.depth_unit is None else options.depth_unit)


def _stated(entry: FrameEntry, key: str) -> bool:
    """Whether a frame has this key, and does not say that there is none."""
    return entry.fields.get(key) is not None


def _value(entry: FrameEntry, key: str, default: object = None) -> object:
    return entry.fields.get(key, entry.shared.get(key, default))


def _number(entry: FrameEntry, key: str, default: float | None = None) -> float:
    value = _value(entry, key, default)
    if not is_number(value):
        found = "no such key, here or at the top" if value is None else shown(value)
        raise InputError(f"{entry.where}: {key}", expected="a finite number", found=found, remedy=f"Add {key}.")
    return float(value)


def _positive(entry: FrameEntry, key: str, default: float | None = None) -> float:
    value = _number(entry, key, default)
    if value <= 0.0:
        raise InputError(f"{entry.where}: {key}", expected="above 0", found=f"{value:g}", remedy="Correct it.")
    return value


def _unit(entry: FrameEntry, key: str, default: float) -> float:
    """Units of one length in another."""
    value = _positive(entry, key, default)
    if not 1.0 / MOST_UNITS <= value <= MOST_UNITS:
        expected = f"{1.0 / MOST_UNITS:g} to {MOST_UNITS:g}"
        raise InputError(f"{entry.where}: {key}", expected=expected, found=f"{value:g}", remedy="Correct it.")
    return value


def _text(entry: FrameEntry, key: str) -> str:
    value = entry.fields.get(key)
    if not isinstance(value, str) or not value:
        raise InputError(f"{entry.where}.{key}", expected="a path", found=shown(value), remedy="Correct it.")
    return value
