"""Intrinsics that no photograph has, refused before anything is made of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.input_file import check_pixel_count
from rgspipe.datasets.scans.frame import Lens
from rgspipe.errors import InputError

#: Focal lengths in parts of the image's larger side, and the most that a coefficient of distortion may be.
FOCAL, STRONGEST = (0.05, 100.0), 100.0

#: Part of an image's width and height by which the principal point may be beside its middle.
BESIDE = 0.24

#: Part by which the shapes of an image and of its intrinsics may differ.
SAME_SHAPE = 0.03


def check_lens(lens: Lens, where: str | Path) -> None:
    """Refuse intrinsics that cannot be meant; `where` names them in errors.

    Raises:
        InputError: not finite, without pixels, a focal length out of all proportion, or a principal point far from the
            middle of the image.
    """
    check_pixel_count(Path(where), lens.width, lens.height)
    bends = np.array([*lens.radial, *lens.tangential, *lens.rational])
    if not (np.isfinite(bends).all() and (np.abs(bends) <= STRONGEST).all()):
        expected = f"coefficients of distortion within ±{STRONGEST:g}"
        raise InputError(where, expected=expected, found=str(bends.tolist()), remedy="Correct them.")
    side = max(lens.width, lens.height)
    if not all(FOCAL[0] * side <= focal <= FOCAL[1] * side for focal in (lens.fx, lens.fy)):
        expected = f"focal lengths in pixels of an image of {lens.width} × {lens.height}"
        raise InputError(where, expected=expected, found=f"{lens.fx:g}, {lens.fy:g}", remedy="Correct them.")
    across, down = lens.cx / lens.width - 0.5, lens.cy / lens.height - 0.5
    if not (abs(across) <= BESIDE and abs(down) <= BESIDE):  # also where they are NaN
        raise InputError(
            where,
            expected=f"a principal point near the middle of {lens.width} × {lens.height} pixels",
            found=f"({lens.cx:g}, {lens.cy:g})",
            remedy="Use intrinsics and size of the same image.",
        )


def check_shape(path: Path, shape: tuple[int, ...], lens: Lens) -> None:
    """Refuse an image of another shape than its intrinsics: it was turned or cropped; another size is fine.

    Raises:
        InputError: naming both.
    """
    height, width = shape[:2]
    if abs(width * lens.height / (height * lens.width) - 1.0) > SAME_SHAPE:
        raise InputError(
            path,
            expected=f"an image of the shape of its intrinsics, {lens.width} × {lens.height}",
            found=f"{width} × {height} pixels",
            remedy="Do not turn or crop images, or change the intrinsics with them.",
        )
