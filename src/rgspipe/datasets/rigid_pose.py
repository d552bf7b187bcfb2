"""Poses and places in files, checked to be such as a scene has."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.datasets.json_file import is_number, shown
from rgspipe.datasets.limits import FARTHEST
from rgspipe.errors import InputError
from rgspipe.scene.rigid import check_rigid


def rigid_pose(value: object, place: str) -> Tensor:
    """A (4, 4) float64 camera-to-world transform, checked to be rigid; `place` names it in errors.

    Raises:
        InputError: not a 4 × 4 list of finite numbers, or not rigid.
    """
    rows = value if isinstance(value, list) else []
    if len(rows) != 4 or not all(isinstance(row, list) and len(row) == 4 for row in rows):
        raise InputError(place, expected="a 4 × 4 matrix", found=shown(value), remedy="Correct it.")
    flat = [item for row in rows for item in row]
    if not all(map(is_number, flat)):
        raise InputError(place, expected="finite numbers", found=shown(value), remedy="Correct it.")
    pose = torch.tensor(flat, dtype=torch.float64).reshape(4, 4)
    check_place(pose[:3, 3].tolist(), place)
    check_rigid(pose.numpy(), place)
    return pose


def check_place(position: list[float], place: str) -> None:
    """Refuse coordinates that are too large to be of a scene; `place` names them in errors.

    Raises:
        InputError: one of them is beyond `FARTHEST`.
    """
    if max(map(abs, position)) > FARTHEST:
        expected = f"a place within ±{FARTHEST:g}"
        raise InputError(place, expected=expected, found=shown(position), remedy="Correct it.")
