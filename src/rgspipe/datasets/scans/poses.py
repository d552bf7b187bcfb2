"""Poses as other programs write them, checked, as camera-to-world transforms with OpenGL axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import is_number, shown
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.datasets.rigid_pose import check_place
from rgspipe.datasets.scans.frame import Numbers
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.errors import InputError
from rgspipe.scene.rigid import check_rigid

#: Largest entry of RᵀR − 1; some programs write four digits.
RIGID = 1e-2

#: From OpenCV's camera axes to OpenGL's.
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


def placed(matrix: Numbers, where: str | Path, options: ScanOptions, axes: str) -> Numbers:
    """A (4, 4) camera-to-world transform with OpenGL axes, exactly rigid.

    Args:
        matrix: (4, 4) camera-to-world as the files have it.
        where: names it in errors.
        options: their axes and unit of places stand over the layout's.
        axes: the layout's, "opengl" or "opencv".

    Raises:
        InputError: it is not finite, or no rigid transform; says what else it may be.
    """
    if not np.isfinite(matrix).all():
        raise InputError(where, expected="finite numbers", found=shown(matrix.tolist()), remedy="Leave the frame out.")
    check_rigid(matrix, where, RIGID)
    pose = matrix @ FLIP if options.camera_axes(axes) == "opencv" else matrix.copy()
    # Few digits leave a rotation that is none; the nearest one is.
    left, _, right = np.linalg.svd(pose[:3, :3])
    pose[:3, :3] = left @ right
    pose[:3, 3] *= 1.0 if options.pose_unit is None else options.pose_unit
    check_place(pose[:3, 3].tolist(), str(where))
    return pose


def from_quaternion(quaternion: Numbers) -> Numbers:
    """(3, 3) rotation of a quaternion (w, x, y, z), which need not have length 1."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix_of(value: object, where: str | Path) -> Numbers:
    """(4, 4) of nested lists, or (3, 4) completed.

    Raises:
        InputError: it is neither, or holds what are no numbers.
    """
    rows = value if isinstance(value, list) and all(isinstance(row, list) for row in value) else []
    good = len({len(row) for row in rows}) == 1 and all(is_number(item) for row in rows for item in row)
    matrix = np.array(rows, dtype=np.float64) if good else np.zeros(0)
    if matrix.shape == (3, 4):
        matrix = np.concatenate([matrix, [[0.0, 0.0, 0.0, 1.0]]])
    if matrix.shape != (4, 4):
        raise InputError(where, expected="a 4 × 4 matrix of finite numbers", found=shown(value), remedy="Correct it.")
    return matrix


@timed
def read_numbers(path: Path, count: int, what: str) -> Numbers:
    """(N, count) numbers of a text file, `count` a line, without lines that begin with #.

    Raises:
        InputError: missing file, or other text.
    """
    text = input_file(path, what, most_bytes=reading_limits().text_bytes).read_text(
        encoding="utf-8-sig", errors="replace"
    )
    rows = [line.split() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    try:
        values = np.array([[float(word) for word in row] for row in rows], dtype=np.float64)
    except ValueError:
        values = np.zeros(0)
    if values.ndim != 2 or values.shape[1] != count:
        raise InputError(path, expected=f"{what}: {count} numbers a line", found="other text", remedy="Write it anew.")
    return values
