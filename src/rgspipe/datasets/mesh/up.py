"""Which axis of a mesh's file points up in the world of its cameras, whose z does."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rgspipe.datasets.mesh.options import GLTF, MeshOptions

#: From y up to z up, as Blender and glTF have it: (x, −z, y).
UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def is_y_up(path: Path, options: MeshOptions) -> bool:
    """Whether a file is taken for one whose y points up."""
    return options.up == "y" or (options.up == "auto" and path.suffix.lower() in GLTF)
