"""Where the mesh of Polycam's raw data is: `raw.glb` was turned and moved after its cameras were stated.

`mesh_info.json` beside it has what was done, by columns, as `alignmentTransform` (PolyCam/polyform, README).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.json_file import numbers, read_json
from rgspipe.datasets.scans.polycam import ROWS
from rgspipe.scene.mesh import Numbers
from rgspipe.scene.rigid import check_rigid

#: The mesh, what says where it is, and the folder beside it that tells that both are Polycam's.
MESH, INFO, KEYFRAMES = "raw.glb", "mesh_info.json", "keyframes"

KEY = "alignmentTransform"

#: Largest entry of RᵀR − 1 of numbers in single precision.
RIGID = 1e-3


def polycam_info(path: Path) -> Path | None:
    """The file that says where a mesh is, if it is that of Polycam's raw data."""
    info = path.with_name(INFO)
    is_own = path.name == MESH and info.is_file() and path.with_name(KEYFRAMES).is_dir()
    return info if is_own else None


def polycam_place(path: Path) -> Numbers | None:
    """(4, 4) from the file's coordinates to the world of Polycam's cameras as they are read; None for other meshes.

    Raises:
        InputError: what was done to the mesh is no rigid transform.
    """
    info = polycam_info(path)
    content = {} if info is None else read_json(info, "what was done to Polycam's mesh")
    if KEY not in content:
        return None
    aligned = np.array(numbers(content[KEY], 16, info, KEY)).reshape(4, 4).T
    check_rigid(aligned, f"{info}: {KEY}", RIGID)
    return np.eye(4)[[*ROWS, 3]] @ np.linalg.inv(aligned)
