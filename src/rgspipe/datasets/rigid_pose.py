"""Poses and places in files, checked to be such as a scene has."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from rgspipe.datasets.json_file import is_number, numbers, required, shown
from rgspipe.datasets.limits import FARTHEST
from rgspipe.errors import InputError
from rgspipe.scene.rigid import check_rigid

#: Keys of a pose that was found anew.
REFINED = {"R_opt", "T_opt"}


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


def refined_pose(fields: Mapping[str, object], where: str) -> Tensor | None:
    """The pose that GS³'s fit of real captures found, which stands over a frame's transform_matrix; None without one.

    `R_opt` takes the camera, with OpenCV axes, to the world, and `T_opt` is where the camera sees the world's origin.

    Raises:
        InputError: only one of both, or they are no pose.
    """
    if not REFINED & fields.keys():
        return None
    rows, place = (required(dict(fields), key, where) for key in ("R_opt", "T_opt"))
    if not isinstance(rows, list) or len(rows) != 3:
        raise InputError(f"{where}.R_opt", expected="a 3 × 3 matrix", found=shown(rows), remedy="Correct it.")
    rotation = torch.tensor([numbers(row, 3, where, "R_opt") for row in rows], dtype=torch.float64)
    seen = torch.tensor(numbers(place, 3, where, "T_opt"), dtype=torch.float64)
    axes = rotation * torch.tensor([1.0, -1.0, -1.0], dtype=torch.float64)
    matrix = torch.cat([axes, -(rotation @ seen)[:, None]], dim=1).tolist()
    return rigid_pose([*matrix, [0.0, 0.0, 0.0, 1.0]], f"{where}.R_opt")


def check_place(position: list[float], place: str) -> None:
    """Refuse coordinates that are too large to be of a scene; `place` names them in errors.

    Raises:
        InputError: one of them is beyond `FARTHEST`.
    """
    if max(map(abs, position)) > FARTHEST:
        expected = f"a place within ±{FARTHEST:g}"
        raise InputError(place, expected=expected, found=shown(position), remedy="Correct it.")
