"""Keys of files of cameras by which a lens is more than focal lengths and a principal point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

#: Models whose distortion is that of DISTORTION, as COLMAP and nerfstudio name both, and the one whose k1 to k4 are of
#: angles, so that it bends lines where they are 0, too.
STRAIGHT = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE")
FISHEYE = "OPENCV_FISHEYE"
DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")

#: What else changes where a camera sees things, in files for nerfstudio and instant-ngp; the last of them tells a
#: fisheye lens by a key of its own.
OTHER_OPTICS = ("k5", "k6", "skew", "distortion_params", "fisheye_crop_radius")
OTHER_OPTICS += ("rolling_shutter", "rolling_shutter_time", "is_fisheye")


def first_that_bends(stated: Mapping[str, object], keys: Iterable[str]) -> str | None:
    """The first of the keys that is neither missing nor null, false, 0 or a list of these; None if all are."""
    for key in keys:
        value = stated.get(key)
        if not all(part in (None, 0) for part in (value if isinstance(value, list) else [value])):  # 0 is False, too
            return key
    return None
