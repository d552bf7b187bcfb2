"""Cameras that files describe by focal lengths and principal point, each under a key of its own, as nerfstudio does."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rgspipe.datasets.json_file import is_number, numbers, shown
from rgspipe.errors import InputError

#: Focal lengths and principal point, in pixels of an image of `w` × `h`.
KEYS = ("fl_x", "fl_y", "cx", "cy")

#: Part by which a field of view that is stated as well may differ, and w and h from the image's shape.
SAME = 0.01


def stated_intrinsics(stated: Mapping[str, object], width: int, height: int, where: str) -> list[float] | None:
    """cx, cy, fx, fy in pixels of an image; None where none of KEYS is stated.

    What is not stated is as usual: square pixels, the middle of the image, and its size. One focal length may be the
    field of view's.

    Args:
        stated: keys of a frame.
        width: of the image, which shows all of the one that is stated, at any size.

    Raises:
        InputError: no numbers, no focal length, an image of another shape, or another field of view.
    """
    if not any(key in stated for key in KEYS):
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
    fx = given.get("fl_x", given.get("fl_y"))
    angle = stated.get("camera_angle_x")
    of_angle = 0.5 * w / math.tan(0.5 * angle) if is_number(angle) and 0.0 < angle < math.pi else None
    fx = of_angle if fx is None else fx
    if fx is None:
        found = ", ".join(key for key in KEYS if key in stated)
        raise InputError(where, expected='"fl_x" or "camera_angle_x", too', found=found, remedy="Add one of them.")
    if angle is not None and (of_angle is None or not abs(fx - of_angle) <= SAME * of_angle):
        found = f'{shown(angle)} rad beside "fl_x": {fx:g} of {w:g} pixels'
        remedy = "Leave away the one that is wrong."
        raise InputError(f"{where}: camera_angle_x", expected="the same field of view", found=found, remedy=remedy)
    across, down = width / w, height / h
    cx, cy = given.get("cx", 0.5 * w), given.get("cy", 0.5 * h)
    return [cx * across, cy * down, fx * across, given.get("fl_y", fx) * down]
