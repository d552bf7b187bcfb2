"""Rigid transforms: what a camera's pose has to be, and what it looks like where it is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from rgspipe.errors import InputError

#: Largest entry of RᵀR − 1 that a rotation may have; numbers in float32 reach 1e-6.
ROTATION_TOLERANCE = 1e-4

EXPECTED = "a rigid camera-to-world transform (orthonormal rotation, determinant +1, last row 0 0 0 1)"
BOTTOM = (0.0, 0.0, 0.0, 1.0)


def check_rigid(matrix: npt.NDArray[np.float64], where: str | Path, tolerance: float = ROTATION_TOLERANCE) -> None:
    """Refuse a (4, 4) matrix of finite numbers that is no camera-to-world transform, and say what it looks like.

    Args:
        where: names it in errors.
        tolerance: largest entry of RᵀR − 1 that is taken.

    Raises:
        InputError: it is transposed, scaled, sheared or mirrored.
    """
    if not np.allclose(matrix[3], BOTTOM):
        transposed = np.allclose(matrix[:, 3], BOTTOM)
        found = "a transposed matrix: columns in the place of rows" if transposed else f"last row {matrix[3].tolist()}"
        raise InputError(where, expected=EXPECTED, found=found, remedy="Write the matrix row by row.")
    rotation = matrix[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        determinant = float(np.linalg.det(rotation))
        error = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if not error <= tolerance:
        found = f"RᵀR − 1 up to {error:.2g}, determinant {determinant:.3g}"
        raise InputError(where, expected=EXPECTED, found=found, remedy="Take scale and shear out of the rotation.")
    if determinant < 0.0:
        raise InputError(
            where,
            expected=EXPECTED,
            found="determinant −1: a mirrored room, which comes of rows that were exchanged or of one axis with "
            "another sign",
            remedy="Put the rows in their order (Polycam's third row goes first), or change the sign of two axes "
            "of the camera (y and z), not of one.",
        )
