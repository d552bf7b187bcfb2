"""Cameras that files describe by focal lengths, principal point and fields of view, each under a key of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rgspipe.datasets.field_of_view import focal_of_angle
from rgspipe.datasets.json_file import numbers, shown
from rgspipe.errors import InputError

#: Focal lengths and principal point, in pixels of an image of `w` × `h`, and fields of view [rad] across and down.
KEYS = ("fl_x", "fl_y", "cx", "cy")
ANGLES = ("camera_angle_x", "camera_angle_y")

#: Part by which a field of view that is stated as well may differ, and w and h from the image's shape.
SAME = 0.01


def stated_intrinsics(stated: Mapping[str, object], width: int, height: int, where: str) -> list[float] | None:
    """cx, cy, fx, fy in pixels of an image; None where none of KEYS and ANGLES is stated.

    What is not stated is as usual: square pixels, the middle of the image, and its size.

    Args:
        stated: keys of a frame.
        width: of the image, which shows all of the one that is stated, at any size.

    Raises:
        InputError: no numbers, no focal length, an image of another shape, or fields of view that contradict it.
    """
    if not any(key in stated for key in (*KEYS, *ANGLES)):
        return None
    given = {key: numbers([stated[key]], 1, where, key)[0] for key in (*KEYS, "w", "h") if key in stated}
    w, h = (given.get(key, float(size)) for key, size in (("w", width), ("h", height)))
    if min(w, h) <= 0.0 or abs(width * h - height * w) > SAME * height * w:
        raise InputError(
            f"{where}: w, h",
            expected=f"the shape of the image, {width} × {height}",
            found=f"{w:g} × {h:g}",
            remedy="State the size that the intrinsics are of; do not turn or crop images without them.",
        )
    angles = zip(ANGLES, (w, h), strict=True)
    of_x, of_y = (focal_of_angle(stated[key], s, f"{where}: {key}") if key in stated else None for key, s in angles)
    focals = [focal for focal in (given.get("fl_x"), of_x, given.get("fl_y"), of_y) if focal is not None]
    if not focals:
        found = ", ".join(key for key in KEYS if key in stated)
        raise InputError(where, expected='"fl_x" or "camera_angle_x", too', found=found, remedy="Add one of them.")
    fx = focals[0]
    # A field of view down that calls for other than square pixels is that of Blender's sensor, more often than not.
    fy = given.get("fl_y", fx)
    for key, angle, focal, size in (("x", of_x, fx, w), ("y", of_y, fy, h)):
        if angle is not None and not abs(focal - angle) <= SAME * angle:
            name, beside = f"camera_angle_{key}", f"a focal length of {focal:g} in {size:g} pixels"
            found = f"{shown(stated[name])} rad beside {beside}, where it is {2.0 * math.atan(0.5 * size / focal):.5g}"
            remedy = "Leave away what is wrong; where pixels are not square, state fl_x and fl_y."
            raise InputError(f"{where}: {name}", expected="the same field of view", found=found, remedy=remedy)
    across, down = width / w, height / h
    cx, cy = given.get("cx", 0.5 * w), given.get("cy", 0.5 * h)
    fy = fy if of_y is None or "fl_y" in given else of_y
    return [cx * across, cy * down, fx * across, fy * down]
