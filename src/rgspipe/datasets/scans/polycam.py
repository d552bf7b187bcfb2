"""Polycam's raw data: `keyframes/` with cameras, photographs, depth in millimetres and its confidence.

A camera's file has the rows of a camera-to-world matrix, t_00 to t_23, in a world with y up; its third row is put
first, so that z is up.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.json_file import numbers, read_json, required, whole
from rgspipe.datasets.scans.frame import DepthImage, Lens, Scan, ScanFrame
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.poses import placed
from rgspipe.errors import InputError

#: Of the cameras.
AXES = "opengl"

WANTED = "keyframes/corrected_cameras/ or keyframes/cameras/"

#: Folders of cameras and their photographs: what the app corrected afterwards goes first.
FOLDERS = (("corrected_cameras", "corrected_images"), ("cameras", "images"))

#: Part of the longer side within which undoing distortion leaves black at the rim; nerfstudio cuts off 15 of 1024.
BORDER = 15 / 1024

MILLIMETRE = 1e-3

#: The rows of the file's matrix in our order.
ROWS = (2, 0, 1)


def found_in(root: Path) -> bool:
    """Whether the folder has this layout."""
    return any((root / "keyframes" / cameras).is_dir() for cameras, _ in FOLDERS)


def read(root: Path, options: ScanOptions) -> Scan:
    """The cameras of all keyframes.

    Raises:
        InputError: no camera files, missing keys, or poses that are not rigid.
    """
    keyframes = root / "keyframes"
    found = {pair: sorted((keyframes / pair[0]).glob("*.json")) for pair in FOLDERS}
    cameras, images = next((pair for pair, files in found.items() if files), FOLDERS[-1])
    files = found[cameras, images]
    if not files:
        raise InputError(keyframes / cameras, expected="a .json file a camera", found="none", remedy="Export raw data.")
    frames = tuple(_frame(path, keyframes, images, options) for path in files)
    return Scan(
        "polycam", keyframes / cameras, tuple(files), frames, options.camera_axes(AXES), ("the world's z is up",)
    )


def _frame(path: Path, keyframes: Path, images: str, options: ScanOptions) -> ScanFrame:
    content = read_json(path, "a camera of Polycam")
    keys = [f"t_{row}{column}" for row in ROWS for column in range(4)]
    values = [numbers([required(content, key, path)], 1, path, key)[0] for key in keys]
    matrix = np.concatenate([np.array(values).reshape(3, 4), [[0.0, 0.0, 0.0, 1.0]]])
    lens = [numbers([required(content, key, path)], 1, path, key)[0] for key in ("fx", "fy", "cx", "cy")]
    size = [whole(required(content, key, path), path, key) for key in ("width", "height")]
    depth, confidence = (keyframes / folder / f"{path.stem}.png" for folder in ("depth", "confidence"))
    unit = MILLIMETRE if options.depth_unit is None else options.depth_unit
    measured = DepthImage(depth, unit, confidence=confidence if confidence.is_file() else None)
    return ScanFrame(
        image=keyframes / images / f"{path.stem}.jpg",
        lens=Lens(*lens, *size),
        pose=placed(matrix, path, options, AXES),
        depth=measured if depth.is_file() else None,
        border=BORDER if images == FOLDERS[0][1] else 0.0,
    )
