"""Photographs without a pose: which one is meant, and the camera that is taken for granted."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rgspipe.datasets.scans.frame import Lens, Numbers
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import size_of
from rgspipe.errors import InputError
from rgspipe.scene import look_at

#: Names that errors list.
SHOWN = 8


def level_pose() -> Numbers:
    """(4, 4) of a camera at the origin that looks along +y."""
    return look_at([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]).numpy()


def chosen(images: Sequence[Path], root: Path, options: ScanOptions) -> Path:
    """The photograph that the options name, or the only one.

    Raises:
        InputError: there are none or several, or none of that name.
    """
    names = ", ".join(path.name for path in images[:SHOWN]) + (", …" if len(images) > SHOWN else "")
    if options.photograph is not None:
        fitting = [path for path in images if options.photograph in (path.name, path.stem)]
        if len(fitting) == 1:
            return fitting[0]
        expected = f"a photograph of the name {options.photograph}"
        raise InputError(root, expected=expected, found=names or "none", remedy="Correct ScanOptions.photograph.")
    if len(images) != 1:
        expected = "one photograph: without poses several do not go together"
        remedy = "Say which: ScanOptions(photograph=NAME)."
        raise InputError(root, expected=expected, found=f"{len(images)} ({names})", remedy=remedy)
    return images[0]


def lens_by_field(image: Path, degrees: float) -> Lens:
    """A pinhole in the middle of an image with so wide a field of view."""
    width, height = size_of(image)
    focal = 0.5 * width / np.tan(np.radians(0.5 * degrees))
    return Lens(focal, focal, 0.5 * width, 0.5 * height, width, height)
