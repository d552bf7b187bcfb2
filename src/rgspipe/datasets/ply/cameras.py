"""Where the cameras stood that a scene of Gaussians was trained from."""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.frames import read_entries
from rgspipe.datasets.json_file import numbers, read_json_value, required
from rgspipe.errors import InputError

#: 3DGS writes it into the model's folder, the scene into point_cloud/iteration_<n>/ below.
NAME, LEVELS_UP = "cameras.json", 3


def find_cameras(ply: Path) -> Path | None:
    """cameras.json of the model that a PLY file belongs to, if there is one."""
    folders = list(ply.resolve().parents)[: LEVELS_UP + 1]
    return next((folder / NAME for folder in folders if (folder / NAME).exists()), None)


def read_viewpoints(path: Path) -> Tensor:
    """(V, 3) float64 positions of the cameras in a 3DGS cameras.json or a transforms file.

    Raises:
        InputError: neither of the two, or no cameras in it.
    """
    content = read_json_value(path, "cameras")
    if isinstance(content, dict):
        entries = read_entries(path, "cameras")
        return torch.stack([entry.pose()[:3, 3] for entry in entries])
    if not isinstance(content, list) or not content or not all(isinstance(item, dict) for item in content):
        raise InputError(
            path,
            expected='a list of cameras, each with a "position", or an object with "frames"',
            found=f"{type(content).__name__} of {len(content) if isinstance(content, list) else 'no'} items",
            remedy="Give the cameras.json of a 3DGS model, or a transforms file.",
        )
    positions = []
    for index, item in enumerate(content):
        where = f"{path}[{index}]"
        positions.append(numbers(required(item, "position", where), 3, where, "position"))
    return torch.tensor(positions, dtype=torch.float64)
